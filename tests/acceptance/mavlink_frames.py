"""Writes MAVLink as a vehicle does. It is written from the message definitions, independently of our C++ code: it sorts the
fields of the XML and computes CRC_EXTRA itself. It makes the golden frames of tests/protocol/mavlink and the messages of
tests/acceptance/mavlink_test.py.

usage: mavlink_frames.py      prints golden frames: version, message, frame in hex, expected fields
"""
import struct

# Message -> number, fields in the order of the XML, extension fields. A field is "type[n] name".
MESSAGES = {
    "HEARTBEAT": (0, "uint8_t type, uint8_t autopilot, uint8_t base_mode, uint32_t custom_mode, uint8_t system_status, "
                     "uint8_t mavlink_version", ""),
    "SYSTEM_TIME": (2, "uint64_t time_unix_usec, uint32_t time_boot_ms", ""),
    "ATTITUDE": (30, "uint32_t time_boot_ms, float roll, float pitch, float yaw, float rollspeed, float pitchspeed, float yawspeed", ""),
    "ATTITUDE_QUATERNION": (31, "uint32_t time_boot_ms, float q1, float q2, float q3, float q4, float rollspeed, float pitchspeed, "
                                "float yawspeed", "float[4] repr_offset_q"),
    "LOCAL_POSITION_NED": (32, "uint32_t time_boot_ms, float x, float y, float z, float vx, float vy, float vz", ""),
    "GLOBAL_POSITION_INT": (33, "uint32_t time_boot_ms, int32_t lat, int32_t lon, int32_t alt, int32_t relative_alt, int16_t vx, "
                                "int16_t vy, int16_t vz, uint16_t hdg", ""),
    "GPS_GLOBAL_ORIGIN": (49, "int32_t latitude, int32_t longitude, int32_t altitude", "uint64_t time_usec"),
    "COMMAND_LONG": (76, "uint8_t target_system, uint8_t target_component, uint16_t command, uint8_t confirmation, float param1, "
                         "float param2, float param3, float param4, float param5, float param6, float param7", ""),
    "VISION_POSITION_ESTIMATE": (102, "uint64_t usec, float x, float y, float z, float roll, float pitch, float yaw",
                                 "float[21] covariance, uint8_t reset_counter"),
    "SIM_STATE": (108, "float q1, float q2, float q3, float q4, float roll, float pitch, float yaw, float xacc, float yacc, "
                       "float zacc, float xgyro, float ygyro, float zgyro, float lat, float lon, float alt, float std_dev_horz, "
                       "float std_dev_vert, float vn, float ve, float vd", "int32_t lat_int, int32_t lon_int"),
    "ATT_POS_MOCAP": (138, "uint64_t time_usec, float[4] q, float x, float y, float z", "float[21] covariance"),
    "ODOMETRY": (331, "uint64_t time_usec, uint8_t frame_id, uint8_t child_frame_id, float x, float y, float z, float[4] q, float vx, "
                      "float vy, float vz, float rollspeed, float pitchspeed, float yawspeed, float[21] pose_covariance, "
                      "float[21] velocity_covariance", "uint8_t reset_counter, uint8_t estimator_type, int8_t quality"),
    "VFR_HUD": (74, "float airspeed, float groundspeed, int16_t heading, uint16_t throttle, float alt, float climb", ""),
}
# The same for messages that sonard only sends; they have no golden frames.
SENT = {
    "COMMAND_ACK": (77, "uint16_t command, uint8_t result",
                    "uint8_t progress, int32_t result_param2, uint8_t target_system, uint8_t target_component"),
    "DISTANCE_SENSOR": (132, "uint32_t time_boot_ms, uint16_t min_distance, uint16_t max_distance, uint16_t current_distance, "
                             "uint8_t type, uint8_t id, uint8_t orientation, uint8_t covariance",
                        "float horizontal_fov, float vertical_fov, float[4] quaternion, uint8_t signal_quality"),
}
CODES = {"uint8_t": "B", "int8_t": "b", "uint16_t": "H", "int16_t": "h", "uint32_t": "I", "int32_t": "i", "uint64_t": "Q", "float": "f"}


def checksum(data, crc=0xFFFF):
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
    return crc


class Field:
    def __init__(self, text):
        kind, self.name = text.split()
        self.type, _, count = kind.partition("[")
        self.count = int(count[:-1]) if count else 0
        self.code = CODES[self.type]
        self.size = struct.calcsize("<" + self.code)

    def pack(self, value):
        values = (value if isinstance(value, (list, tuple)) else [value]) if self.count else [value]
        values = list(values) + [0] * (max(self.count, 1) - len(values))
        return struct.pack(f"<{len(values)}{self.code}", *values)


class Layout:
    def __init__(self, name):
        self.name = name
        self.id, base, extensions = (MESSAGES | SENT)[name]
        self.base = sorted((Field(f) for f in base.split(", ")), key=lambda f: -f.size)  # the sort is stable
        self.extensions = [Field(f) for f in extensions.split(", ")] if extensions else []
        seed = name.encode() + b" "
        for field in self.base:
            seed += f"{field.type} {field.name} ".encode() + (bytes([field.count]) if field.count else b"")
        crc = checksum(seed)
        self.crc_extra = (crc & 0xFF) ^ (crc >> 8)


LAYOUTS = {name: Layout(name) for name in MESSAGES | SENT}


class Speaker:
    """frame = Speaker(system=1, component=1)("HEARTBEAT", autopilot=3)"""

    def __init__(self, system=1, component=1, version=2):
        self.system, self.component, self.version, self.sequence = system, component, version, 0

    def __call__(self, message, **values):
        layout = LAYOUTS[message]
        fields = layout.base + (layout.extensions if self.version == 2 else [])
        unknown = values.keys() - {f.name for f in fields}
        assert not unknown, f"{message} has no {unknown}"
        payload = b"".join(f.pack(values.get(f.name, 0)) for f in fields)
        if self.version == 2:
            payload = payload.rstrip(b"\0") or b"\0"
            head = struct.pack("<BBBBBB", len(payload), 0, 0, self.sequence, self.system, self.component) + struct.pack("<I", layout.id)[:3]
        else:
            head = struct.pack("<BBBBB", len(payload), self.sequence, self.system, self.component, layout.id)
        self.sequence = (self.sequence + 1) % 256
        crc = checksum(bytes([layout.crc_extra]), checksum(head + payload))
        return (b"\xfd" if self.version == 2 else b"\xfe") + head + payload + struct.pack("<H", crc)


def read_frames(datagram):
    """Decodes the messages that sonard sends to (message, fields). Accepts only version 2 and known messages."""
    by_id = {layout.id: layout for layout in LAYOUTS.values()}
    while datagram:
        magic, length, flags, _, _, _, system, component = struct.unpack_from("<BBBBBBBB", datagram[:5] + b"\0" + datagram[5:7])
        assert magic == 0xFD and flags == 0, datagram.hex()
        layout = by_id[int.from_bytes(datagram[7:10], "little")]
        payload, crc = datagram[10:10 + length], struct.unpack_from("<H", datagram, 10 + length)[0]
        assert crc == checksum(bytes([layout.crc_extra]), checksum(datagram[1:10 + length])), datagram.hex()
        fields = layout.base + layout.extensions
        payload += bytes(300 - len(payload))
        values, at = {"system": system, "component": component}, 0
        for f in fields:
            values[f.name] = struct.unpack_from(f"<{max(f.count, 1)}{f.code}", payload, at)
            values[f.name] = values[f.name] if f.count else values[f.name][0]
            at += f.size * max(f.count, 1)
        yield layout.name, values
        datagram = datagram[12 + length:]


def golden_lines():
    """Yields golden lines. Every field has a different value that a float represents exactly; the last field of the payload is 0
    in every second message."""
    for number, name in enumerate(MESSAGES):
        for version in (1, 2):
            layout = LAYOUTS[name]
            if version == 1 and layout.id > 255:
                continue
            fields = layout.base + (layout.extensions if version == 2 else [])
            values = {}
            for i, f in enumerate(fields):
                start = (i + 1) * (0.25 if f.type == "float" else 1) + number
                values[f.name] = [start + 0.5 * k for k in range(f.count)] if f.count else start if f.type == "float" else int(start)
                if f.type.startswith("int") and i % 2:
                    values[f.name] = -values[f.name]
            if number % 2:
                values[fields[-1].name] = [0] * fields[-1].count if fields[-1].count else 0
            speaker = Speaker(system=number + 1, component=200 + number, version=version)
            speaker.sequence = 100 + number
            frame = speaker(name, **values)
            said = " ".join(f"{f.name}=" + ",".join(f"{v:g}" for v in (values[f.name] if f.count else [values[f.name]])) for f in fields)
            yield f"{version} {name} {frame.hex()} {said}"


if __name__ == "__main__":
    print("\n".join(golden_lines()))
