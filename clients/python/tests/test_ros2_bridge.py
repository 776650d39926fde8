"""The ROS 2 bridge without ROS: frames, the line that it sends, the data that it reads from sonard, and its package files."""
import ast
import importlib.util
import json
import math
import struct
import sys
import unittest
import xml.etree.ElementTree

from common import ROOT
from ros_stand_ins import BRIDGE

from sonard_bridge import conversions as c
from sonard_bridge import live_view as v
from sonard_client.rotations import quaternion_from_rpy

HALF = math.sqrt(0.5)


class Frames(unittest.TestCase):
    def assert_close(self, got, wanted):
        self.assertEqual(len(got), len(wanted))
        for a, b in zip(got, wanted):
            self.assertAlmostEqual(a, b, places=12)

    def test_quaternions_are_reordered(self):
        self.assert_close(c.wxyz((0.1, 0.2, 0.3, math.sqrt(0.86))), (math.sqrt(0.86), 0.1, 0.2, 0.3))
        self.assert_close(c.xyzw(c.wxyz((0, 0, HALF, HALF))), (0, 0, HALF, HALF))
        for bad in ((0, 0, 0, 0), (0, 0, 0, 2), (math.nan, 0, 0, 1)):
            with self.subTest(bad), self.assertRaises(c.Unusable):
                c.wxyz(bad)

    def test_vectors_are_turned_from_body_to_world(self):
        bow_north = (HALF, 0, 0, HALF)  # ENU: yaw 90 degrees
        self.assert_close(c.rotate(bow_north, (1, 0, 0)), (0, 1, 0))
        self.assert_close(c.rotate(bow_north, (0, 1, 0)), (-1, 0, 0))  # port is west

    def test_aircraft_axes_are_converted(self):
        self.assert_close(c.enu_from_ned((1, 2, 3)), (2, 1, -3))
        self.assert_close(c.flu_from_frd((1, 2, 3)), (1, -2, -3))
        for rpy in ((0, 0, 0), (0.1, -0.2, 0.3), (-1, 0.5, 2.5)):
            ned, enu = quaternion_from_rpy(*rpy), quaternion_from_rpy(rpy[0], -rpy[1], math.pi / 2 - rpy[2])
            turned = c.enu_flu_from_ned_frd(ned)
            self.assertAlmostEqual(abs(sum(a * b for a, b in zip(turned, enu))), 1, places=12)
            for v in ((1, 0, 0), (0, 1, 0), (0.3, -0.4, 2)):
                self.assert_close(c.rotate(turned, c.flu_from_frd(v)), c.enu_from_ned(c.rotate(ned, v)))

    def test_images_have_z_ahead_and_y_to_port(self):
        self.assert_close(c.flu_from_image((0, 0, 1)), (1, 0, 0))
        self.assert_close(c.flu_from_image((0, 1, 0)), (0, 1, 0))
        self.assert_close(c.flu_from_image((1, 0, 0)), (0, 0, -1))  # right-handed: x is down
        for v in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 2, 3)):
            self.assert_close(c.image_from_flu(c.flu_from_image(v)), v)
            self.assert_close(c.rotate(c.wxyz(c.IMAGE_IN_FLU_XYZW), v), c.flu_from_image(v))

    def test_the_manual_gives_the_same_rotations(self):
        text = (ROOT / "clients/ros2_bridge/README.md").read_text(encoding="utf-8")
        image, clouds = ([float(part.split(f"--q{axis} ")[1].split()[0]) for axis in "xyzw"]
                         for part in text.split("static_transform_publisher")[1:3])
        for got, wanted in zip(image, c.IMAGE_IN_FLU_XYZW):
            self.assertAlmostEqual(got, wanted, places=7)
        self.assert_close(c.rotate(c.wxyz(clouds), (2, -1.64, 0.5)), c.flu_from_frd((2, -1.64, 0.5)))


class Scans(unittest.TestCase):
    def test_angles_are_even_from_starboard_to_port(self):
        scan = c.scan_of([0.6, 0.1, 0.0, -0.6], [6, 0, 5, 4])
        self.assertAlmostEqual(scan.first_rad, -0.6)
        self.assertAlmostEqual(scan.step_rad, 0.4)
        self.assertEqual(scan.range_m, [4, 5, math.inf, 6])  # -0.6, -0.2, 0.2, 0.6
        for azimuths, ranges in (([0.0], [1]), ([], []), ([0.1, 0.0], [1])):
            with self.assertRaises(c.Unusable):
                c.scan_of(azimuths, ranges)

    def test_names_are_made_valid_for_topics(self):
        self.assertEqual([c.name_in_topic(name) for name in ("front", "3d-15", "bug über")], ["front", "_3d_15", "bug__ber"])


class ViewMessages(unittest.TestCase):
    """The bytes follow protobuf's encoding: field number times 8 plus type, then the value."""

    def test_transforms_are_read(self):
        turn = bytes([0x11]) + struct.pack("<d", -0.5) + bytes([0x21]) + struct.pack("<d", 0.5)  # y, w; x and z are 0
        body = (b"\x0a\x05\x08\x03\x10\xac\x02" + b"\x12\x03rov" + b"\x1a\x05front" +
                b"\x22\x09\x19" + struct.pack("<d", 2.5) + bytes([0x2a, len(turn)]) + turn)
        one, = v.transforms(bytes([0x0a, len(body)]) + body)
        self.assertEqual(one, v.Transform(3_000_000_300, "rov", "front", (0, 0, 2.5), (0.5, 0, -0.5, 0)))
        for end in range(1, len(body)):
            with self.subTest(end=end), self.assertRaises(ValueError):
                v.transforms(bytes([0x0a, len(body)]) + body[:end])

    def test_clouds_are_read(self):
        field = b"\x0a\x01x" + b"\x15\x04\x00\x00\x00" + b"\x18\x07"
        cloud = v.cloud(b"\x12\x05front" + b"\x25\x10\x00\x00\x00" + bytes([0x2a, len(field)]) + field + b"\x32\x02ab")
        self.assertEqual(cloud, v.Cloud(0, "front", 16, [("x", 4, 7)], b"ab"))
        with self.assertRaises(ValueError):
            v.cloud(b"")

    def test_truth_is_read(self):
        floats = struct.pack("<2f", 0.5, -0.5)
        truth = v.truth(b"\x1a\x08" + floats + b"\x22\x08" + floats + b"\x31" + struct.pack("<d", 7.5))
        self.assertEqual(truth, v.Truth(0, [0.5, -0.5], [0.5, -0.5], 0, 7.5))


class Lines(unittest.TestCase):
    def test_a_line_has_pose_and_velocity(self):
        line = json.loads(c.json_line((1, 2, -3), (HALF, 0, 0, HALF), 12.5, "rov", (1, 0, 0)))
        self.assertEqual((line["frame"], line["position"]), ("ENU_FLU", [1, 2, -3]))
        self.assertEqual((line["timestamp"], line["vehicle"]), (12.5, "rov"))
        self.assertAlmostEqual(line["velocity"][1], 1)
        self.assertEqual(set(json.loads(c.json_line((0, 0, 0), (1, 0, 0, 0)))), {"frame", "position", "quaternion"})
        self.assertNotIn("velocity", json.loads(c.json_line((0, 0, 0), (1, 0, 0, 0), velocity_in_body=(math.nan, 0, 0))))

    def test_invalid_poses_are_not_sent(self):
        for position, stamp in (((math.nan, 0, 0), None), ((1, 2), None), ((0, 0, 0), -1.0), ((0, 0, 0), 5e9)):
            with self.subTest(position, stamp=stamp), self.assertRaises(c.Unusable):
                c.json_line(position, (1, 0, 0, 0), stamp)

    def test_stamps_are_written(self):
        self.assertIsNone(c.stamp_s(0, 0))
        self.assertEqual(c.stamp_s(3, 500_000_000), 3.5)

    def test_endpoints_are_parsed(self):
        self.assertEqual(c.endpoint("10.0.0.1", 7), ("10.0.0.1", 7))
        self.assertEqual(c.endpoint("10.0.0.1:9", 7), ("10.0.0.1", 9))
        for wrong in ("10.0.0.1:x", "10.0.0.1:", "10.0.0.1:0", "10.0.0.1:65536", ":9", "", "10.0.0.1:²"):
            with self.subTest(wrong), self.assertRaises(ValueError):
                c.endpoint(wrong, 7)

    def test_the_vehicle_is_found_in_the_status(self):
        status = {"vehicles": [{"name": "rov", "position": {"x": 1, "z": -3}, "orientation": {"w": 1}}, {"name": "buoy"}]}
        self.assertEqual(c.vehicle_in(status, "rov"), ((1, 0, -3), (1, 0, 0, 0)))
        for name in ("", "buoy", "none"):
            self.assertIsNone(c.vehicle_in(status, name))
        self.assertIsNone(c.vehicle_in({}, ""))
        for status, ns in (({"now_ns": "7500000000"}, 7500000000), ({"now_ns": 3}, 3), ({}, 0), ({"now_ns": "x"}, 0)):
            self.assertEqual(c.stamp_ns(status), ns)


class Package(unittest.TestCase):
    MODULES = {"tf2_ros": "tf2_ros_py"}  # of packages with another name

    def test_files_are_complete(self):
        package = xml.etree.ElementTree.parse(BRIDGE / "package.xml").getroot()
        setup = (BRIDGE / "setup.py").read_text(encoding="utf-8")
        self.assertEqual(package.findtext("name"), "sonard_bridge")
        self.assertTrue((BRIDGE / "resource" / package.findtext("name")).exists())
        self.assertIn(f'version="{package.findtext("version")}"', setup)
        for file in (BRIDGE / "launch").iterdir():
            self.assertIn(f'"launch/{file.name}"', setup)

    def test_every_import_is_a_dependency_and_every_dependency_is_imported(self):
        package = xml.etree.ElementTree.parse(BRIDGE / "package.xml").getroot()
        imported = set()
        for file in (*BRIDGE.glob("sonard_bridge/*.py"), *BRIDGE.glob("launch/*.py")):
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"), str(file))):
                if isinstance(node, ast.Import):
                    imported |= {alias.name.split(".")[0] for alias in node.names}
                elif isinstance(node, ast.ImportFrom) and node.level == 0:
                    imported.add(node.module.split(".")[0])
        foreign = {self.MODULES.get(name, name) for name in imported if name not in sys.stdlib_module_names | {"sonard_bridge"}}
        self.assertEqual(foreign, {depend.text for depend in package.iter("exec_depend")})

    def test_names_that_modules_import_of_each_other_exist(self):
        for file in BRIDGE.glob("sonard_bridge/*.py"):
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"), str(file))):
                if isinstance(node, ast.ImportFrom) and node.level == 1 and node.module:
                    module = importlib.import_module("sonard_bridge." + node.module)
                    self.assertEqual([a.name for a in node.names if not hasattr(module, a.name)], [], file.name)


if __name__ == "__main__":
    unittest.main()
