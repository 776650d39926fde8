"""The judge's reader of a DVL: docs/protocols/dvl.md."""
import json
import struct
import types
import unittest

import judge_makes
from sonard_client.judge import ros_tap
from sonard_client.judge.makes import dvl, make_of


def line(vx, valid=True, kind="velocity", **more):
    report = {"time": 180.2, "vx": vx, "vy": -0.2, "vz": 0, "fom": 0.001, "altitude": 3.25, "transducers": [{"id": 0}],
              "velocity_valid": valid, "type": kind, **more}
    return (json.dumps(report) + "\r\n").encode()


class Reader(judge_makes.StreamChecks, unittest.TestCase):
    make, numbers, size, step = dvl.DVL, None, (1, 1), 1
    messages = [[line(0.1)], [line(0.25)]]
    samples = [struct.pack(form, 0.1, -0.2, 0, 3.25) for form in ("<4d", "<4f")]
    junk_pieces = (b"{", b'{"type": "velocity"}\n', b"[" * 5000, b"\n", line(0.1, kind="position_local"))

    def test_invalid_velocities_are_optional(self):
        found = [ping.needed for ping in self.found(line(0.1), line(0.1, valid=False), b"{\0" + line(0.1))]
        self.assertEqual(found, [True, False, False])

    def test_values_that_are_not_numbers_are_refused(self):
        for value in ("fast", None, [], 10 ** 400):
            self.assertEqual(self.found(line(value)), [], value)
        self.assertEqual(self.found(line(1e300)), [], "no 32-bit float")
        self.assertEqual(self.found(b"x" * 200_000, line(0.1)[:-1]), [])
        self.assertEqual(len(self.found(b"x" * 200_000, line(0.1))), 1, "a line without end is dropped")

    def test_lines_of_ros_messages_are_read(self):
        message = types.SimpleNamespace(velocity=types.SimpleNamespace(x=0.5, y=-0.2, z=0), altitude=3.25)  # dvl_msgs/DVL
        (crcs, _) = dvl._velocity(line(0.5))
        self.assertIn(int(json.loads(ros_tap.line_of(message))["crc32"], 16), crcs)
        report = types.SimpleNamespace(vx=0.5, vy=-0.2, vz=0.0, altitude=3.25)  # waterlinked_a50/TransducerReportStamped
        self.assertEqual(ros_tap.line_of(types.SimpleNamespace(report=report)), ros_tap.line_of(message))
        del message.velocity  # sensor_msgs/NavSatFix
        self.assertEqual(json.loads(ros_tap.line_of(message)), {"id": None, "crc32": "00000000"})

    def test_the_make_is_read(self):
        self.assertIs(make_of("dvl-a125"), dvl.DVL)
        self.assertFalse(dvl.DVL.needs_request)


if __name__ == "__main__":
    unittest.main()
