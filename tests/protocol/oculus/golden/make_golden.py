#!/usr/bin/env python3
"""Writes the golden pairs of this folder: name.bin, laid out by hand with struct, and name.json, the same values with the
vendor's names. It is deliberately independent of the C++ code: it was written from the published layouts."""
import json
import pathlib
import struct

HERE = pathlib.Path(__file__).parent


def header(kind, version, payload, source=7001, destination=0, part=0):
    fields = {"oculusId": 0x4F53, "srcDeviceId": source, "dstDeviceId": destination, "msgId": kind, "msgVersion": version,
              "payloadSize": payload, "partNumber": part}
    return fields, struct.pack("<5HIH", *fields.values())


FIRE = {"masterMode": 2, "pingRate": 1, "networkSpeed": 25, "gammaCorrection": 127, "flags": 0x0D, "range": 2.54,
        "gainPercent": 70.0, "speedOfSound": 1490.658551265436, "salinity": 35.0}
EXTENSION = {"extFlags": 4, "reserved0": [1, 2], "beaconLocatorFrequency": 3, "reserved1": [5, 6, 7, 8, 9]}
FIRE_BYTES = struct.pack("<5B4d", *FIRE.values())
EXTENSION_BYTES = struct.pack("<9I", 4, 1, 2, 3, 5, 6, 7, 8, 9)
BEARINGS = [-3000, -1000, 1000, 3000]
GAINS = [1, 4, 65536]
SAMPLES = [[0, 1, 2, 3], [10, 20, 30, 40], [251, 252, 253, 254]]


def image():
    return b"".join(struct.pack("<I4B", gain, *row) for gain, row in zip(GAINS, SAMPLES))


def ping(version):
    sizes = {"imageOffset": 2048, "imageSize": 24, "messageSize": 2072}
    head, head_bytes = header(0x23, version, 2056)
    fields = {"header": head, "fire": FIRE}
    body = FIRE_BYTES
    if version == 2:
        fields["extension"] = EXTENSION
        body += EXTENSION_BYTES
    first = {"pingId": 415323, "status": 0, "frequency": 2098880.5970149254, "temperature": 12.5, "pressure": 1.5}
    fields |= first
    body += struct.pack("<2I3d", *first.values())
    if version == 2:
        attitude = {"heading": 359.5, "pitch": -2.25, "roll": 0.75}
        fields |= attitude
        body += struct.pack("<3d", *attitude.values())
    fields["speedOfSoundUsed"] = 1490.658551265436
    fields["pingStartTime"] = 1.000001 if version == 2 else 3103899264
    body += struct.pack("<dd" if version == 2 else "<dI", fields["speedOfSoundUsed"], fields["pingStartTime"])
    shape = {"dataSize": 0, "rangeResolution": 0.0028421889710794315, "nRanges": 3, "nBeams": 4}
    fields |= shape
    body += struct.pack("<Bd2H", *shape.values())
    if version == 2:
        fields["spare"] = [0, 0, 0, 0]
        body += bytes(16)
    fields["sizes"] = sizes
    body += struct.pack("<3I", *sizes.values())
    message = head_bytes + body
    assert len(message) == (202 if version == 2 else 122)
    message += struct.pack("<4h", *BEARINGS)
    message += bytes(2048 - len(message)) + image()
    blocks = {"bearings": BEARINGS, "rowGains": GAINS, "samples": SAMPLES}
    return {"fields": fields, "blocks": blocks}, message


def status():
    head, head_bytes = header(1, 0, 126, part=1042)
    words = {"deviceId": 7001, "deviceType": 1, "partNumber": 1042, "status": 3, "firmwareVersion0": 0x01020003,
             "firmwareDate0": 4, "firmwareVersion1": 5, "firmwareDate1": 6, "bitfileVersion": 7, "bitfileDate": 8}
    octets = {"ipAddr": [192, 168, 1, 2], "ipMask": [255, 255, 255, 0], "connectedIpAddr": [10, 0, 0, 7],
              "macAddr": [2, 0, 0, 0, 27, 89]}
    doubles = {"temperature": [15.0, 16.0, 17.0, 18.0, 19.0, 20.0, 21.0, 22.0], "pressure": 1.5}
    body = struct.pack("<I2H7I", *words.values()) + bytes(sum(octets.values(), []))
    body += struct.pack("<9d", *doubles["temperature"], doubles["pressure"])
    return {"fields": {"header": head} | words | octets | doubles}, head_bytes + body


def simple(kind, version, tail_fields, tail, **rest):
    head, head_bytes = header(kind, version, len(tail), **rest)
    return {"fields": {"header": head} | tail_fields}, head_bytes + tail


PAIRS = {
    "fire_v0": simple(0x15, 0, {"fire": FIRE}, FIRE_BYTES, source=0, destination=7001),
    "fire_v2": simple(0x15, 2, {"fire": FIRE, "extension": EXTENSION}, FIRE_BYTES + EXTENSION_BYTES, source=0),
    "status": status(),
    "ping_v0": ping(0),
    "ping_v1": ping(1),
    "ping_v2": ping(2),
    "dummy": simple(0xFF, 0, {}, b""),
    "user_config": simple(0x55, 0, {"ipAddr": 0xC0A80102, "ipMask": 0xFFFFFF00, "dhcpEnable": 1},
                          bytes.fromhex("0201a8c000ffffff01000000")),
}

for name, (text, data) in PAIRS.items():
    (HERE / f"{name}.json").write_text(json.dumps(text, indent=1) + "\n")
    (HERE / f"{name}.bin").write_bytes(data)
