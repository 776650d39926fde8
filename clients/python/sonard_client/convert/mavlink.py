"""Parses MAVLink 1 and 2 frames and the messages with positions and attitudes.

Layouts and CRC seeds follow from MAVLink's message definitions (minimal, standard, common): fields by decreasing size, then
extensions. Version 2 payloads are sent without trailing zeros.
"""
from __future__ import annotations

import struct
from typing import Dict, NamedTuple, Optional, Tuple

V1, V2 = 0xFE, 0xFD
SIGNED = 0x01
SIGNATURE_BYTES = 13


class Message(NamedTuple):
    name: str
    seed: int           # CRC_EXTRA
    fixed: str          # struct's format without extensions
    extensions: str
    fields: Tuple[str, ...]


def _names(text: str) -> Tuple[str, ...]:
    return tuple(text.split())


_SIM_STATE = ("q1 q2 q3 q4 roll pitch yaw xacc yacc zacc xgyro ygyro zgyro lat lon alt std_dev_horz std_dev_vert vn ve vd "
              "lat_int lon_int")
_PRESSURE = "time_boot_ms press_abs press_diff temperature temperature_press_diff"
MESSAGES: Dict[int, Message] = {
    0: Message("HEARTBEAT", 50, "I5B", "", _names("custom_mode type autopilot base_mode system_status mavlink_version")),
    29: Message("SCALED_PRESSURE", 115, "I2fh", "h", _names(_PRESSURE)),
    30: Message("ATTITUDE", 39, "I6f", "", _names("time_boot_ms roll pitch yaw rollspeed pitchspeed yawspeed")),
    31: Message("ATTITUDE_QUATERNION", 246, "I7f", "4f",
                _names("time_boot_ms q1 q2 q3 q4 rollspeed pitchspeed yawspeed offset1 offset2 offset3 offset4")),
    32: Message("LOCAL_POSITION_NED", 185, "I6f", "", _names("time_boot_ms x y z vx vy vz")),
    33: Message("GLOBAL_POSITION_INT", 104, "I4i3hH", "", _names("time_boot_ms lat lon alt relative_alt vx vy vz hdg")),
    49: Message("GPS_GLOBAL_ORIGIN", 39, "3i", "Q", _names("latitude longitude altitude time_usec")),
    74: Message("VFR_HUD", 20, "4fhH", "", _names("airspeed groundspeed alt climb heading throttle")),
    102: Message("VISION_POSITION_ESTIMATE", 158, "Q6f", "84xB", _names("time_usec x y z roll pitch yaw reset_counter")),
    108: Message("SIM_STATE", 32, "21f", "2i", _names(_SIM_STATE)),
    137: Message("SCALED_PRESSURE2", 195, "I2fh", "h", _names(_PRESSURE)),
    138: Message("ATT_POS_MOCAP", 109, "Q7f", "84x", _names("time_usec q1 q2 q3 q4 x y z")),
    143: Message("SCALED_PRESSURE3", 131, "I2fh", "h", _names(_PRESSURE)),
    331: Message("ODOMETRY", 91, "Q13f168xBB", "BBb",
                 _names("time_usec x y z q1 q2 q3 q4 vx vy vz rollspeed pitchspeed yawspeed frame_id child_frame_id "
                        "reset_counter estimator_type quality")),
}
SUBMARINE = 12  # MAV_TYPE
# MAV_FRAME, as frame_id and child_frame_id of ODOMETRY. Since 2019 common.xml has only descriptions of 13 to 19, and no names.
FRAMES = _names("GLOBAL LOCAL_NED MISSION GLOBAL_RELATIVE_ALT LOCAL_ENU GLOBAL_INT GLOBAL_RELATIVE_ALT_INT LOCAL_OFFSET_NED BODY_NED "
                "BODY_OFFSET_NED GLOBAL_TERRAIN_ALT GLOBAL_TERRAIN_ALT_INT BODY_FRD BODY_FLU MOCAP_NED MOCAP_ENU VISION_NED "
                "VISION_ENU ESTIM_NED ESTIM_ENU LOCAL_FRD LOCAL_FLU")
LOCAL_FRD, LOCAL_FLU, BODY_FLU = (FRAMES.index(name) for name in ("LOCAL_FRD", "LOCAL_FLU", "BODY_FLU"))
NED_WORLDS = tuple(map(FRAMES.index, ("LOCAL_NED", "MOCAP_NED", "VISION_NED", "ESTIM_NED")))
ENU_WORLDS = tuple(map(FRAMES.index, ("LOCAL_ENU", "MOCAP_ENU", "VISION_ENU", "ESTIM_ENU")))
FRD_BODIES = tuple(map(FRAMES.index, ("BODY_NED", "BODY_OFFSET_NED", "BODY_FRD")))  # the first two are deprecated and mean FRD


def frame_text(frame: float) -> str:
    """Returns a MAV_FRAME with its name: "12 (BODY_FRD)"."""
    return f"{frame:.0f}" + (f" ({FRAMES[int(frame)]})" if frame < len(FRAMES) else "")


def _crc_of_byte(value: int) -> int:
    for _ in range(8):
        value = value >> 1 ^ (0x8408 if value & 1 else 0)
    return value


_CRCS = tuple(map(_crc_of_byte, range(256)))


def crc(data: bytes, seed: int) -> int:
    """Returns the CRC-16/MCRF4XX over `data`, which begins after the magic byte, and the seed."""
    value = 0xFFFF
    for byte in data:
        value = value >> 8 ^ _CRCS[(value ^ byte) & 0xFF]
    return value >> 8 ^ _CRCS[(value ^ seed) & 0xFF]


class Frame(NamedTuple):
    message_id: int
    system: int
    component: int
    payload: bytes
    length: int          # bytes, from magic to signature
    intact: "Optional[bool]"  # None: a message with unknown seed


def frame_length(data: bytes, at: int) -> Optional[int]:
    """Returns the length of the frame at `at`, or None if no frame begins there. The frame may exceed the data."""
    if at + 3 > len(data):
        return None
    if data[at] == V1:
        return 8 + data[at + 1]
    if data[at] == V2 and data[at + 2] & ~SIGNED == 0:
        return 12 + data[at + 1] + (SIGNATURE_BYTES if data[at + 2] & SIGNED else 0)
    return None


def read_frame(data: bytes, at: int) -> Optional[Frame]:
    """Returns the frame at `at`; None if there is none or it is incomplete."""
    length = frame_length(data, at)
    if length is None or at + length > len(data):
        return None
    size = data[at + 1]
    head = 6 if data[at] == V1 else 10
    body = data[at + 1:at + head + size]
    message_id = data[at + 5] if head == 6 else int.from_bytes(data[at + 7:at + 10], "little")
    known = MESSAGES.get(message_id)
    sum_of = int.from_bytes(data[at + head + size:at + head + size + 2], "little")
    system = data[at + 3] if head == 6 else data[at + 5]
    component = data[at + 4] if head == 6 else data[at + 6]
    return Frame(message_id, system, component, data[at + head:at + head + size], length,
                 crc(body, known.seed) == sum_of if known else None)


def fields_of(frame: Frame) -> "Optional[Dict[str, float]]":
    """Returns the fields of a known message; extensions that were not sent are 0, as MAVLink requires. Returns None for unknown
    messages and for payloads that are too long."""
    known = MESSAGES.get(frame.message_id)
    if known is None:
        return None
    whole = struct.Struct("<" + known.fixed + known.extensions)
    if len(frame.payload) > whole.size:
        return None
    return dict(zip(known.fields, whole.unpack(frame.payload.ljust(whole.size, b"\0"))))
