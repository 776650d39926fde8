"""Reads every field of every Oculus message, with the dissector's filter names, from the sources of docs/protocols/oculus.md.

It shares no code with sonard or the dissector. Fields that oculus_reader.Ping also reads must have the same values there.
"""
import struct

from oculus_reader import Ping

HEADER = [("oculusId", "H"), ("srcDeviceId", "H"), ("dstDeviceId", "H"), ("msgId", "H"), ("msgVersion", "H"),
          ("payloadSize", "I"), ("partNumber", "H")]
FIRE = [("masterMode", "B"), ("pingRate", "B"), ("networkSpeed", "B"), ("gammaCorrection", "B"), ("flags", "B"), ("range", "d"),
        ("gainPercent", "d"), ("speedOfSound", "d"), ("salinity", "d")]
EXTENSION = [("extFlags", "I"), *[("reserved0", "I")] * 2, ("beaconLocatorFrequency", "I"), *[("reserved1", "I")] * 5]
STATUS = [("deviceId", "I"), ("deviceType", "H"), ("partNumber", "H"), ("status", "I"), ("firmwareVersion0", "I"),
          ("firmwareDate0", "I"), ("firmwareVersion1", "I"), ("firmwareDate1", "I"), ("bitfileVersion", "I"),
          ("bitfileDate", "I"), ("ipAddr", "ip"), ("ipMask", "ip"), ("connectedIpAddr", "ip"), ("macAddr", "mac"),
          *[("temperature", "d")] * 8, ("pressure", "d")]
CONFIG = [("ipAddr", "reversed ip"), ("ipMask", "reversed ip"), ("dhcpEnable", "I")]
RESULT = [("pingId", "I"), ("status", "I"), ("frequency", "d"), ("temperature", "d"), ("pressure", "d")]
ATTITUDE = [("heading", "d"), ("pitch", "d"), ("roll", "d")]
GRID = [("dataSize", "B"), ("rangeResolution", "d"), ("nRanges", "H"), ("nBeams", "H")]
SIZES = [("imageOffset", "I"), ("imageSize", "I"), ("messageSize", "I")]
RESULT_V1 = [*RESULT, ("speedOfSoundUsed", "d"), ("pingStartTime", "I"), *GRID, *SIZES]
RESULT_V2 = [*RESULT, *ATTITUDE, ("speedOfSoundUsed", "d"), ("pingStartTimeSeconds", "d"), *GRID, *[("spare", "I")] * 4, *SIZES]


def _text(kind, raw):
    if kind == "mac":
        return raw.hex(":")
    return ".".join(str(octet) for octet in (raw if kind == "ip" else raw[::-1]))


def _read(message, offset, prefix, layout):
    for name, kind in layout:
        size = {"ip": 4, "reversed ip": 4, "mac": 6}.get(kind) or struct.calcsize("<" + kind)
        raw = bytes(message[offset:offset + size])
        assert len(raw) == size, f"{name} does not fit"
        yield f"{prefix}.{name}", raw, _text(kind, raw) if len(kind) > 1 else struct.unpack("<" + kind, raw)[0]
        offset += size


def fields_of(message):
    """Returns [(filter name without "oculus.", its bytes, its value)] in wire order."""
    kind, version = struct.unpack_from("<HH", message, 6)
    fire = FIRE + (EXTENSION if version == 2 else [])
    found = list(_read(message, 0, "header", HEADER))
    if kind in (0x15, 0x23):
        found += _read(message, 16, "fire", fire)
    if kind == 0x01:
        found += _read(message, 16, "status", STATUS)
    if kind == 0x55:
        found += _read(message, 16, "config", CONFIG)
    if kind == 0x23:
        found += _read(message, 89 if version == 2 else 53, "ping", RESULT_V2 if version == 2 else RESULT_V1)
        _expect_as_read_before(Ping(message), dict((name, value) for name, _, value in found))
    return found


def _expect_as_read_before(ping, values):
    """Compares the fields with those of oculus_reader, the older reader, which other tests use."""
    pairs = {"fire.masterMode": ping.mode, "fire.flags": ping.flags, "fire.range": ping.range, "fire.gainPercent": ping.gain,
             "ping.pingId": ping.id, "ping.frequency": ping.frequency, "ping.speedOfSoundUsed": ping.sound_speed_used,
             "ping.dataSize": ping.data_size, "ping.rangeResolution": ping.resolution, "ping.nRanges": ping.rows,
             "ping.nBeams": ping.beams, "ping.imageOffset": ping.image_offset, "ping.imageSize": ping.image_size}
    for name, value in pairs.items():
        assert values[name] == value, name
