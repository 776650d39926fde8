"""Synthetic logs of autopilots, robots and instruments for the tests: a vehicle that moves north-east and turns."""
import contextlib
import functools
import math
import sqlite3
import struct
import zlib

STEP_S = 0.1
ORIGIN = (47.6, -122.33, 10.0)  # degrees, m


def moment(step):
    """Returns time [s], north, east, down [m], roll, pitch, yaw [rad]."""
    t = STEP_S * step
    return t, 0.5 * t, 0.25 * t, 2 + 0.1 * t, 0.02 * math.sin(t), -0.1, 0.5 + 0.05 * t


def times(a, b):
    return (a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0])


def quaternion(roll, pitch, yaw):
    """Returns w, x, y, z, computed as a product of rotations about single axes."""
    about = [(math.cos(yaw / 2), 0, 0, math.sin(yaw / 2)), (math.cos(pitch / 2), 0, math.sin(pitch / 2), 0),
             (math.cos(roll / 2), math.sin(roll / 2), 0, 0)]
    return functools.reduce(times, about)


def degrees_at(north, east, down):
    """Returns a position near ORIGIN, computed with the two radii of curvature; accurate to a millimetre within 100 m."""
    latitude, a, e2 = math.radians(ORIGIN[0]), 6378137.0, 6.69437999014e-3
    w = 1 - e2 * math.sin(latitude) ** 2
    meridian, across = a * (1 - e2) / w ** 1.5, a / math.sqrt(w)
    return (ORIGIN[0] + math.degrees(north / (meridian + ORIGIN[2])),
            ORIGIN[1] + math.degrees(east / ((across + ORIGIN[2]) * math.cos(latitude))), ORIGIN[2] - down)


# --- dataflash ---

DATAFLASH = {
    "ATT": (10, "QccccCCCCB", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw,AEKF", "QhhhhHHHHB"),
    "POS": (11, "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt", "Qiifff"),
    "XKF1": (12, "QBccCfffffffccce", "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD,GX,GY,GZ,OH", "QBhhHfffffffhhhi"),
    "SIM": (13, "QccCfLLffff", "TimeUS,Roll,Pitch,Yaw,Alt,Lat,Lng,Q1,Q2,Q3,Q4", "QhhHfiiffff"),
    "ORGN": (14, "QBLLe", "TimeUS,Type,Lat,Lng,Alt", "QBiii"),
    "MSG": (15, "QZ", "TimeUS,Message", "Q64s"),
}


def dataflash_format(name, length=None):
    number, characters, labels, layout = DATAFLASH[name]
    length = length or 3 + struct.calcsize("<" + layout)
    return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", number, length, name.encode(), characters.encode(), labels.encode())


def dataflash_message(name, *values):
    return b"\xa3\x95" + bytes((DATAFLASH[name][0],)) + struct.pack("<" + DATAFLASH[name][3], *values)


def _centidegrees(angle):
    return round(100 * math.degrees(angle))


def dataflash_log(kinds=("ATT", "POS"), steps=50):
    """Returns a log with the given messages; POS at every second step."""
    out = b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", 128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns")
    out += b"".join(map(dataflash_format, DATAFLASH))
    out += dataflash_message("ORGN", 0, 0, round(1e7 * ORIGIN[0]), round(1e7 * ORIGIN[1]), round(100 * ORIGIN[2]))
    out += dataflash_message("MSG", 0, b"made by hand \xa3\x95\x0a")
    for step in range(steps):
        t, north, east, down, roll, pitch, yaw = moment(step)
        us, (lat, lon, alt) = round(1e6 * t), degrees_at(north, east, down)
        lat, lon = round(1e7 * lat), round(1e7 * lon)
        angles = _centidegrees(roll), _centidegrees(pitch), _centidegrees(yaw)
        if "ATT" in kinds:
            out += dataflash_message("ATT", us, 0, angles[0], 0, angles[1], 0, angles[2], 0, 0, 3)
        if "POS" in kinds and step % 2 == 0:
            out += dataflash_message("POS", us, lat, lon, alt, 0, 0)
        for core in (0, 1) if "XKF1" in kinds else ():
            out += dataflash_message("XKF1", us, core, *angles, 0, 0, 0, 0, north, east, down + 100 * core, 0, 0, 0, 0)
        if "SIM" in kinds:
            out += dataflash_message("SIM", us, *angles, alt, lat, lon, *quaternion(roll, pitch, yaw))
    return out


# --- telemetry ---

# Number, seed of the CRC, fields, extensions: written independently of the package, from the message definitions.
MAVLINK = {
    "HEARTBEAT": (0, 50, "IBBBBB", ""), "ATTITUDE": (30, 39, "Iffffff", ""), "ATTITUDE_QUATERNION": (31, 246, "Ifffffff", "ffff"),
    "LOCAL_POSITION_NED": (32, 185, "Iffffff", ""), "GLOBAL_POSITION_INT": (33, 104, "IiiiihhhH", ""),
    "GPS_GLOBAL_ORIGIN": (49, 39, "iii", "Q"), "VFR_HUD": (74, 20, "ffffhH", ""),
    "SCALED_PRESSURE": (29, 115, "Iffh", "h"), "SCALED_PRESSURE2": (137, 195, "Iffh", "h"),
    "VISION_POSITION_ESTIMATE": (102, 158, "Qffffff", "21fB"),
    "SIM_STATE": (108, 32, "21f", "ii"), "ATT_POS_MOCAP": (138, 109, "Qfffffff", "21f"),
    "ODOMETRY": (331, 91, "Q3f4f3f3f168xBB", "BBb"),
}


def crc16(data):
    """CRC-16/MCRF4XX, in its bytewise form without tables."""
    value = 0xFFFF
    for byte in data:
        part = byte ^ (value & 0xFF)
        part = (part ^ part << 4) & 0xFF
        value = value >> 8 ^ part << 8 ^ part << 3 ^ part >> 4
    return value


def mavlink_frame(name, values, version=2, system=1, sequence=0, signed=False, component=1):
    number, seed, fixed, extensions = MAVLINK[name]
    full = struct.pack("<" + fixed + (extensions if version == 2 else ""), *values)
    if version == 1:
        body = struct.pack("<BBBBB", len(full), sequence, system, component, number) + full
        return b"\xfe" + body + struct.pack("<H", crc16(body + bytes((seed,))))
    full = full.rstrip(b"\0") or b"\0"
    body = struct.pack("<BBBBBB", len(full), signed, 0, sequence, system, component) + number.to_bytes(3, "little") + full
    return b"\xfd" + body + struct.pack("<H", crc16(body + bytes((seed,)))) + (b"thirteenbytes" if signed else b"")


def telemetry_log(kinds=("ATTITUDE", "LOCAL_POSITION_NED"), steps=50, version=2, began_s=1_700_000_000, boot_s=25, frames=(1, 8),
                  turned=(1, 0, 0, 0)):
    """frames: frame_id and child_frame_id of ODOMETRY; turned: rotation of its body axes from FRD."""
    out = b""

    def put(step, name, *values, system=1):
        nonlocal out
        late_us = 1000 * (step * 7 % 5)  # delay of the radio link
        stamp = round(1e6 * (began_s + STEP_S * step)) + late_us
        out += stamp.to_bytes(8, "big") + mavlink_frame(name, values, version, system, step & 0xFF)

    origin = round(1e7 * ORIGIN[0]), round(1e7 * ORIGIN[1]), round(1e3 * ORIGIN[2])
    put(0, "GPS_GLOBAL_ORIGIN", *origin, *([0] if version == 2 else []))
    for step in range(steps):
        t, north, east, down, roll, pitch, yaw = moment(step)
        boot_ms, q, (lat, lon, alt) = round(1e3 * (t + boot_s)), quaternion(roll, pitch, yaw), degrees_at(north, east, down)
        put(step, "HEARTBEAT", 0, 6, 8, 0, 0, 3, system=255)
        if "ATTITUDE" in kinds:
            put(step, "ATTITUDE", boot_ms, roll, pitch, yaw, 0, 0, 0)
        if "ATTITUDE_QUATERNION" in kinds:
            put(step, "ATTITUDE_QUATERNION", boot_ms, *q, 0, 0, 0, *([0] * 4 if version == 2 else []))
        if "LOCAL_POSITION_NED" in kinds and step % 2 == 0:
            put(step, "LOCAL_POSITION_NED", boot_ms, north, east, down, 0, 0, 0)
        if "GLOBAL_POSITION_INT" in kinds and step % 2 == 0:
            put(step, "GLOBAL_POSITION_INT", boot_ms, round(1e7 * lat), round(1e7 * lon), round(1e3 * alt), 0, 0, 0, 0, 0)
        if "SIM_STATE" in kinds:
            put(step, "SIM_STATE", *q, roll, pitch, yaw, *[0] * 6, lat, lon, alt, *[0] * 5,
                *([round(1e7 * lat), round(1e7 * lon)] if version == 2 else []))
        if "ODOMETRY" in kinds:
            put(step, "ODOMETRY", 1000 * boot_ms, north, east, down, *times(q, turned), *[0] * 6, *frames,
                *([0] * 3 if version == 2 else []))
    return out


# --- ROS messages ---

class Cdr:
    """CDR, or the unpadded encoding of ROS 1."""

    def __init__(self, ros1=False, big=False):
        self.out, self.ros1, self.order = b"", ros1, ">" if big else "<"

    def put(self, kind, *values):
        size = struct.calcsize("=" + kind)
        self.out += b"" if self.ros1 else bytes(-len(self.out) % size)
        self.out += struct.pack(f"{self.order}{len(values)}{kind}", *values)
        return self

    def text(self, text):
        raw = text.encode() + (b"" if self.ros1 else b"\0")
        self.put("I", len(raw))
        self.out += raw
        return self

    def header(self, t, frame):
        if self.ros1:
            self.put("I", 7)
        return self.put("I", int(t)).put("I", round((t - int(t)) * 1e9)).text(frame)

    def done(self):
        return self.out if self.ros1 else (b"\0\0\0\0" if self.order == ">" else b"\0\1\0\0") + self.out


def enu_moment(step):
    """Returns the moment in ROS's axes: time; east, north, up; x, y, z, w."""
    t, north, east, down, roll, pitch, yaw = moment(step)
    w, x, y, z = quaternion(roll, -pitch, math.pi / 2 - yaw)
    return t, (east, north, -down), (x, y, z, w)


def odometry(step, t0=100, **how):
    t, position, xyzw = enu_moment(step)
    cdr = Cdr(**how).header(t0 + t, "odom").text("base_link").put("d", *position, *xyzw).put("d", *[0] * 36)
    return cdr.put("d", *[0] * 6).put("d", *[0] * 36).done()


def pose_stamped(step, t0=100, frame="map", **how):
    t, position, xyzw = enu_moment(step)
    return Cdr(**how).header(t0 + t if t0 else 0, frame).put("d", *position, *xyzw).done()


def path(steps, t0=100, stamped=True, **how):
    """Returns nav_msgs/Path: a header, and poses with headers."""
    cdr = Cdr(**how).header(t0 + len(steps), "map").put("I", len(steps))
    for step in steps:
        t, position, xyzw = enu_moment(step)
        cdr.header(t0 + t if stamped else 0, "map").put("d", *position, *xyzw)
    return cdr.done()


def transforms(step, t0=100, **how):
    t, position, xyzw = enu_moment(step)
    cdr = Cdr(**how).put("I", 2)
    for parent, child, scale in (("map", "odom", 0), ("odom", "base_link", 1)):
        cdr.header(t0 + t, parent).text(child).put("d", *(scale * p for p in position), *xyzw)
    return cdr.done()


# --- MCAP ---

def _text(text):
    return struct.pack("<I", len(text.encode())) + text.encode()


def mcap_record(opcode, content):
    return struct.pack("<BQ", opcode, len(content)) + content


def mcap_chunk(records, compression="", packed=None, crc32=None):
    crc32 = zlib.crc32(records) if crc32 is None else crc32
    packed = records if packed is None else packed
    head = struct.pack("<QQQI", 0, 0, len(records), crc32) + _text(compression)
    return mcap_record(0x06, head + struct.pack("<Q", len(packed)) + packed)


def mcap(channels, chunk_messages=10, closed=True, chunked=True, compress=("", lambda data: data)):
    """channels: [(topic, encoding, schema, [(log time in s, bytes)])]"""
    out = b"\x89MCAP0\r\n" + mcap_record(0x01, _text("") + _text("by hand"))
    head = b""
    for number, (topic, encoding, schema, _) in enumerate(channels, 1):
        head += mcap_record(0x03, struct.pack("<H", number) + _text(schema) + _text("text") + struct.pack("<I", 0))
        head += mcap_record(0x04, struct.pack("<HH", number, number) + _text(topic) + _text(encoding) + struct.pack("<I", 0))
    messages = [mcap_record(0x05, struct.pack("<HIQQ", n, i, round(1e9 * t), 0) + data)
                for n, (_, _, _, logged) in enumerate(channels, 1) for i, (t, data) in enumerate(logged)]
    for first in range(0, len(messages), chunk_messages):
        records = (head if first == 0 else b"") + b"".join(messages[first:first + chunk_messages])
        out += mcap_chunk(records, compress[0], compress[1](records)) if chunked else records
    if not closed:
        return out
    return out + mcap_record(0x0F, bytes(4)) + mcap_record(0x02, bytes(20)) + b"\x89MCAP0\r\n"


# --- ROS 1 bag ---

def bag_record(fields, data):
    head = b"".join(struct.pack("<I", len(name) + 1 + len(value)) + name.encode() + b"=" + value for name, value in fields)
    return struct.pack("<I", len(head)) + head + struct.pack("<I", len(data)) + data


def bag(connections, compression="none", pack=lambda data: data):
    """connections: [(topic, type, [(time in s, bytes)])]"""
    inner = b""
    for number, (topic, kind, logged) in enumerate(connections):
        conn = ("conn", struct.pack("<I", number))
        described = struct.pack("<I", len(kind) + 5) + b"type=" + kind.encode()
        inner += bag_record([("op", b"\x07"), conn, ("topic", topic.encode())], described)
        for t, data in logged:
            stamp = struct.pack("<II", int(t), round((t - int(t)) * 1e9))
            inner += bag_record([("op", b"\x02"), conn, ("time", stamp)], data)
    size = ("size", struct.pack("<I", len(inner)))
    chunk = bag_record([("op", b"\x05"), ("compression", compression.encode()), size], pack(inner))
    return b"#ROSBAG V2.0\n" + bag_record([("op", b"\x03"), ("index_pos", bytes(8))], b" " * 100) + chunk


# --- NMEA ---

def sentence(body):
    total = functools.reduce(lambda a, b: a ^ b, body.encode(), 0)
    return f"${body}*{total:02X}\r\n"


def _minutes(value, width, halves):
    whole = int(abs(value))
    return f"{whole:0{width}d}{60 * (abs(value) - whole):011.8f},{halves[value < 0]}"


def nmea_log(steps=20, began_s=43200, kinds=("HDT", "PHTRO", "GGA", "DBT")):
    out = ""
    for step in range(steps):
        t, north, east, down, roll, pitch, yaw = moment(step)
        lat, lon, _ = degrees_at(north, east, down)
        place = f"{_minutes(lat, 2, 'NS')},{_minutes(lon, 3, 'EW')}"
        s = (began_s + t) % 86400
        clock = f"{int(s // 3600):02d}{int(s // 60 % 60):02d}{s % 60:06.3f}"
        if "HDT" in kinds:
            out += sentence(f"HEHDT,{math.degrees(yaw):.6f},T")
        if "PHTRO" in kinds:
            out += sentence(f"PHTRO,{abs(math.degrees(pitch)):.6f},{'M' if pitch >= 0 else 'P'},"
                            f"{abs(math.degrees(roll)):.6f},{'T' if roll >= 0 else 'B'}")
        if "PRDID" in kinds:
            out += sentence(f"PRDID,{math.degrees(pitch):+.6f},{math.degrees(roll):+.6f},{math.degrees(yaw):.6f}")
        if "DBT" in kinds:
            out += sentence(f"SDDBT,,f,{20 - down:.6f},M,,F")
        if "GGA" in kinds:
            out += sentence(f"GPGGA,{clock},{place},4,10,0.8,33.1,M,-17.0,M,,")
        if "RMC" in kinds:
            out += sentence(f"GPRMC,{clock},A,{place},1.1,26.6,211126,,")
    return out


# --- recordings of ROS 2 in SQLite ---

def db3(path, topics):
    """Writes [(topic, type, [(log time [s], message)])] like rosbag2's sqlite3 storage."""
    with contextlib.closing(sqlite3.connect(path)) as base, base:
        base.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
                     "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)")
        base.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, "
                     "data BLOB NOT NULL)")
        for number, (topic, kind, messages) in enumerate(topics, 1):
            base.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')", (number, topic, kind))
            base.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)",
                             [(number, round(1e9 * t), data) for t, data in messages])
    return path


# --- logs of PX4 ---

def ulog_message(kind, content):
    return struct.pack("<HB", len(content), ord(kind)) + content


def ulog(truth=False, steps=50, has_place=True, local=0):
    """local: the instance of the local position."""
    formats = ["vehicle_attitude:uint64_t timestamp;uint64_t timestamp_sample;float[4] q;float[4] delta_q_reset;uint8_t n;"
               "uint8_t[7] _padding0",
               "vehicle_local_position:uint64_t timestamp;float x;float y;float z;double ref_lat;double ref_lon;float ref_alt;"
               "bool xy_valid;bool z_valid;bool xy_global;bool z_global;uint8_t[4] _padding0",
               "vehicle_attitude_groundtruth:uint64_t timestamp;float[4] q",
               "vehicle_local_position_groundtruth:uint64_t timestamp;float[3] a;float x;float y;float z"]
    out = b"ULog\x01\x12\x35\x01" + bytes(8) + ulog_message("B", bytes(40))
    out += b"".join(ulog_message("F", text.encode()) for text in formats)
    out += ulog_message("F", b"other:uint64_t timestamp;nested[2] n")
    names = [text.split(":")[0] for text in formats]
    out += b"".join(ulog_message("A", struct.pack("<BH", local * (n == 1), n) + name.encode()) for n, name in enumerate(names))
    out += ulog_message("A", bytes([1]) + struct.pack("<H", 9) + b"vehicle_attitude")  # a second instance
    for step in range(steps):
        t, north, east, down, *angles = moment(step)
        stamp = round(1e6 * t)
        out += ulog_message("D", struct.pack("<HQQ4f4fB", 9, stamp, stamp, *quaternion(1, 1, 1), 0, 0, 0, 0, 1))
        out += ulog_message("D", struct.pack("<HQQ4f4fB", 0, stamp + 2000, stamp, *quaternion(*angles), 0, 0, 0, 0, 1))
        out += ulog_message("D", struct.pack("<HQ3f2df4?", 1, stamp, north, east, down, *ORIGIN, has_place, step > 0, True, True))
        if truth:
            out += ulog_message("D", struct.pack("<HQ4f", 2, stamp, *quaternion(*angles)))
            out += ulog_message("D", struct.pack("<HQ6f", 3, stamp, 0, 0, 0, north, east, down + 100))
    return out


ROS2_TOPICS = [("/odom", "nav_msgs/msg/Odometry", [(100 + i, odometry(i)) for i in range(5)]),
               ("/image", "sensor_msgs/msg/Image", [(100, b"not read")])]


def telemetry_without_place(kinds, submarine=True, steps=20):
    """Returns a tlog of messages of these kinds. Their positions contain only the depth."""
    log = bytearray()
    for step in range(steps):
        t, _, _, down, *angles = moment(step)
        ms = round(1000 * t) + 25000
        values = {"HEARTBEAT": (0, 12 if submarine else 2, 3, 0, 0, 3), "ATTITUDE": (ms, *angles, 0, 0, 0),
                  "GLOBAL_POSITION_INT": (ms, 0, 0, 0, round(-1000 * down), 0, 0, 0, 0), "VFR_HUD": (0, 0, -down, 0, 0, 0)}
        for kind in kinds:
            log += round(1e6 * (1_700_000_000 + t)).to_bytes(8, "big") + mavlink_frame(kind, values[kind])
    return bytes(log)
