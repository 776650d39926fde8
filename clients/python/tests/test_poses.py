"""Encoding of poses: rotations against closed forms, protobuf decoded by protoc, rejected values."""
import json
import math
import re
import shutil
import socket
import subprocess
import unittest

from common import ROOT

from sonard_client import PoseSender
from sonard_client.pose_messages import PoseMessage, json_line, pose_update
from sonard_client.rotations import quaternion_from_rpy, to_body

PROTOC = shutil.which("protoc")


def decoded_by_protoc(data):
    """Returns {"position.x": "1.5", ...} of a PoseUpdate, decoded by protoc."""
    command = [PROTOC, f"--proto_path={ROOT}/protocol/control", "--decode=sonar.v1.PoseUpdate", "control.proto"]
    text = subprocess.run(command, input=data, capture_output=True, timeout=60, check=True).stdout.decode()
    fields, path = {}, []
    for line in text.splitlines():
        line = line.strip()
        if line.endswith("{"):
            path.append(line[:-2])
        elif line == "}":
            path.pop()
        else:
            name, value = line.split(": ", 1)
            fields[".".join(path + [name])] = value
    return fields


class Receiver:
    """A socket in place of sonard."""

    def __enter__(self):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(10)
        self.address = "127.0.0.1:%d" % self.socket.getsockname()[1]
        return self

    def __exit__(self, *_):
        self.socket.close()


class Rotations(unittest.TestCase):
    def test_angles_are_intrinsic_z_y_x(self):
        half = math.sqrt(0.5)
        for rpy, q in (((math.pi / 2, 0, 0), (half, half, 0, 0)), ((0, math.pi / 2, 0), (half, 0, half, 0)),
                       ((0, 0, math.pi / 2), (half, 0, 0, half)), ((math.pi / 2, 0, math.pi / 2), (0.5, 0.5, 0.5, 0.5))):
            for found, expected in zip(quaternion_from_rpy(*rpy), q):
                self.assertAlmostEqual(found, expected)

    def test_vectors_are_turned_from_world_to_body(self):
        port_turn = quaternion_from_rpy(0, 0, math.pi / 2)  # bow to +y
        for found, expected in zip(to_body(port_turn, (1, 2, 3)), (2, -1, 3)):
            self.assertAlmostEqual(found, expected)
        mixed = quaternion_from_rpy(0.3, -0.4, 1.2)
        self.assertAlmostEqual(math.hypot(*to_body(mixed, (1, 2, 3))[:2]) ** 2 + to_body(mixed, (1, 2, 3))[2] ** 2, 14)


class Messages(unittest.TestCase):
    pose = PoseMessage((1.5, -2, 300), quaternion_from_rpy(0, 0, math.pi / 2), "NED_FRD", "rov é", (1, 2, 3), (0.1, 0.2, 0.3),
                       2.5, "wall", 300, 7)

    @unittest.skipUnless(PROTOC, "protoc is not installed")
    def test_protobuf_messages_have_their_fields(self):
        fields = decoded_by_protoc(pose_update(self.pose))
        self.assertEqual((fields["frame"], fields["seq"], fields["reset_counter"]), ("NED_FRD", "300", "7"))
        self.assertEqual((fields["time.domain"], fields["time.ns"]), ("WALL", "2500000000"))
        self.assertEqual(fields["vehicle"], '"rov \\303\\251"')
        for name, value in (("position.x", 1.5), ("position.y", -2), ("position.z", 300), ("orientation.z", math.sqrt(0.5)),
                            ("twist.linear.x", 2), ("twist.linear.y", -1), ("twist.angular.z", 0.3)):
            self.assertAlmostEqual(float(fields[name]), value)
        self.assertFalse([name for name in fields if re.search(r"(^|\.)\d", name)], "unknown fields")

    @unittest.skipUnless(PROTOC, "protoc is not installed")
    def test_default_time_is_arrival(self):
        fields = decoded_by_protoc(pose_update(PoseMessage((0, 0, 0), (1, 0, 0, 0), "ENU_FLU")))
        self.assertEqual((fields["time.domain"], fields["frame"]), ("ARRIVAL", "ENU_FLU"))
        self.assertNotIn("time.ns", fields)
        self.assertNotIn("twist.linear.x", fields)

    def test_json_lines_have_their_keys(self):
        line = json_line(self.pose)
        self.assertTrue(line.endswith(b"\n"))
        fields = json.loads(line)
        self.assertEqual((fields["frame"], fields["vehicle"], fields["timestamp"]), ("NED_FRD", "rov é", 2.5))
        self.assertEqual((fields["position"], fields["velocity"]), ([1.5, -2, 300], [1, 2, 3]))

    def test_one_datagram_per_pose_with_increasing_numbers(self):
        with Receiver() as there, PoseSender(there.address, vehicle="rov") as poses:
            poses.send((1, 2, 3), rpy=(0, 0, 0.5))
            poses.send([4, 5, 6], quaternion=[0, 0, 0, 1.0005], vehicle="other")
            first, second = (json.loads(there.socket.recv(4096)) for _ in range(2))
        self.assertEqual((first["vehicle"], second["vehicle"]), ("rov", "other"))
        self.assertAlmostEqual(first["quaternion"][3], math.sin(0.25))
        self.assertEqual(second["quaternion"], [0, 0, 0, 1])  # normalised
        with Receiver() as there, PoseSender(there.address, "protobuf") as poses:
            for number in (1, 2, 3):
                poses.send((0, 0, 0))
                self.assertIn(bytes([0x10, number]), there.socket.recv(1200))  # field 2, varint


class Refusals(unittest.TestCase):
    def test_values_that_sonard_refuses_raise_errors(self):
        with Receiver() as there, PoseSender(there.address) as poses:
            for bad in (dict(position=(1, 2)), dict(position=(1, 2, float("nan"))), dict(quaternion=(2, 0, 0, 0)),
                        dict(quaternion=(1, 0, 0)), dict(frame="NED"), dict(quaternion=(1, 0, 0, 0), rpy=(0, 0, 0)),
                        dict(timestamp=float("inf")), dict(velocity=(1, 2)), dict(angular_velocity=(0, 0, 1))):
                with self.subTest(**bad), self.assertRaises(ValueError):
                    poses.send(**dict(dict(position=(0, 0, 0)), **bad))
            poses.send((0, 0, 7))
            self.assertEqual(json.loads(there.socket.recv(4096))["position"], [0, 0, 7])  # the others were not sent

    def test_invalid_senders_are_refused(self):
        for bad in (dict(encoding="xml"), dict(transport="sctp"), dict(encoding="protobuf", transport="tcp"), dict(clock="wall"),
                    dict(clock="arrival")):
            with self.subTest(**bad), self.assertRaises(ValueError):
                PoseSender("127.0.0.1:9", **bad)

    def test_closed_port_is_counted_without_an_error(self):
        with Receiver() as there:
            address = there.address
        with PoseSender(address) as poses:
            for _ in range(20):
                poses.send((0, 0, 0))
            self.assertGreater(poses.undelivered, 0)


if __name__ == "__main__":
    unittest.main()
