"""Parts that the tests share: the package on the path, a configuration, and synthetic pings.

SONARD_BUILD names the build folder; ctest sets it. SONARD_CLIENT_NUMPY=hidden disables numpy.
"""
import os
import pathlib
import struct
import sys

if os.environ.get("SONARD_CLIENT_NUMPY") == "hidden":
    sys.modules["numpy"] = None

ROOT = pathlib.Path(__file__).resolve().parents[3]
PACKAGE = ROOT / "clients/python"
sys.path.insert(0, str(PACKAGE))
SONARD = pathlib.Path(os.environ.get("SONARD_BUILD", ROOT / "build/release")) / "daemon/sonard"
GOLDEN = ROOT / "tests/protocol/oculus/golden"

CONFIG = """
world: {scene: SCENE, seed: 1}
vehicles: [{name: rov, initial_pose: {frame: ENU_FLU, xyz_m: [0, 0, 0]}}]
sonars: [{name: front, profile: oculus-m1200d, bind_ip: ADDRESS, status_to: [ADDRESS], mount: {frame: FLU, xyz_m: [0, 0, 0]}}]
poses: {protobuf: "ADDRESS:14770", json: "ADDRESS:14771"}
control: {stream: "ADDRESS:14770", http: "ADDRESS:8088"MORE}
"""


def config(scene="l-targets.yaml", more=""):
    return CONFIG.replace("SCENE", str(ROOT / "scenes" / scene)).replace("MORE", more)


def made_ping(version=0, width=1, rows=3, beams=4, gains=None, samples=None, number=7, bearings=None, row_m=0.5):
    """Returns a synthetic ping message."""
    flags = 0x09 | (0x04 if gains else 0)
    fire = struct.pack("<5B4d", 2, 0, 255, 127, flags, 10.0, 50.0, 1500.0, 0.0) + (bytes(36) if version == 2 else b"")
    samples = samples or [[16 * row + beam for beam in range(beams)] for row in range(rows)]
    image = b""
    for row, values in enumerate(samples):
        image += struct.pack("<I", gains[row]) if gains else b""
        image += b"".join(value.to_bytes(width, "little") for value in values)
    head = struct.pack("<II3d", number, 0, 2.1e6, 12.5, 1.5)
    head += struct.pack("<5d", 90.0, 1.0, -2.0, 1500.0, 3.25) if version == 2 else struct.pack("<dI", 1500.0, 99)
    head += struct.pack("<BdHH", width - 1, row_m, rows, beams) + (bytes(16) if version == 2 else b"")
    head += struct.pack("<III", 2048, len(image), 2048 + len(image))
    header = struct.pack("<5HIH", 0x4F53, 7001, 0, 0x23, version, 2048 + len(image) - 16, 0)
    front = header + fire + head + struct.pack(f"<{beams}h", *(bearings or range(-100, 100 * beams - 100, 100)))
    return front + bytes(2048 - len(front)) + image
