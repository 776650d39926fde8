"""Logs made by hand, converted: poses against the way they were made from; whatever is cut off or changed ends in poses or in one
sentence."""
import bz2
import contextlib
import io
import json
import math
import pathlib
import random
import struct
import tempfile
import unittest
from unittest import mock

import common  # noqa: F401  puts the package on the path
import made_logs as made

from sonard_client.convert import ConvertError, Geodetic, convert, format_of
from sonard_client.convert import compression
from sonard_client.convert.__main__ import main
from sonard_client.convert.mavlink import crc
from sonard_client.geodesy import LocalPlane, ecef, parse_origin
from sonard_client.nmea import Assumptions
from sonard_client.rotations import between, quaternion_from_rpy

HERE = Geodetic(*made.ORIGIN)


class WithFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.warned = []

    def file(self, data, name="log"):
        path = self.folder / name
        path.write_bytes(data if isinstance(data, bytes) else data.encode())
        return path

    def convert(self, data, **how):
        self.warned = []
        return convert(self.file(data), warn=self.warned.append, **how)

    def assert_way(self, track, steps, every=1, t0=0.0, metres=0.01, radians=2e-4, origin_down=0.0):
        """track is the way of made_logs.moment(), in NED_FRD or ENU_FLU; angles to a rounded hundredth of a degree."""
        self.assertEqual(len(track.rows), len(steps), track.rows[:2])
        for row, step in zip(track.rows, steps):
            t, north, east, down, roll, pitch, yaw = made.moment(step)
            position, turn = (north, east, down - origin_down), made.quaternion(roll, pitch, yaw)
            if track.frame == "ENU_FLU":
                _, position, xyzw = made.enu_moment(step)
                turn = xyzw[3], xyzw[0], xyzw[1], xyzw[2]
            self.assertAlmostEqual(row.t_s, t0 + t, delta=0.0051)
            for got, wanted in zip(row.position_m, position):
                self.assertAlmostEqual(got, wanted, delta=metres)
            cosine = abs(sum(a * b for a, b in zip(row.orientation, turn)))
            self.assertLess(2 * math.acos(min(1.0, cosine)), radians)


class Geodesy(unittest.TestCase):
    def test_known_points_of_the_ellipsoid(self):
        for place, there in (((0, 0, 0), (6378137, 0, 0)), ((0, 90, 10), (0, 6378147, 0)), ((90, 0, 0), (0, 0, 6356752.3142))):
            for got, wanted in zip(ecef(Geodetic(*place)), there):
                self.assertAlmostEqual(got, wanted, delta=1e-4)

    def test_axes_point_north_east_and_down(self):
        plane = LocalPlane(HERE)
        self.assertLess(max(map(abs, plane.ned(HERE))), 1e-6)
        for wanted in ((30, 0, 0), (0, 40, 0), (0, 0, -5), (12, -7, 3)):
            for got, value in zip(plane.ned(Geodetic(*made.degrees_at(*wanted))), wanted):
                self.assertAlmostEqual(got, value, delta=2e-3)

    def test_metres_of_one_origin_in_those_of_another(self):
        other = LocalPlane(Geodetic(*made.degrees_at(100, 50, -20)))
        for got, value in zip(LocalPlane(HERE).ned_from(other, (1, 2, 3)), (101, 52, -17)):
            self.assertAlmostEqual(got, value, delta=5e-3)

    def test_origins_in_words(self):
        self.assertEqual(parse_origin("47.6,-122.33"), Geodetic(47.6, -122.33, 0))
        for bad in ("47.6", "a,b", "91,0,0", "1,2,3,4", "nan,0,0", ""):
            with self.subTest(bad), self.assertRaises(ValueError):
                parse_origin(bad)

    def test_half_way_between_two_rotations(self):
        a, b = quaternion_from_rpy(0, 0, 0.2), quaternion_from_rpy(0, 0, 1.0)
        for second in (b, tuple(-v for v in b)):
            for got, wanted in zip(between(a, second, 0.25), quaternion_from_rpy(0, 0, 0.4)):
                self.assertAlmostEqual(got, wanted, places=12)
        self.assertAlmostEqual(between(a, a, 0.5)[0], a[0])


class Dataflash(WithFolder):
    def test_attitude_and_position_are_paired(self):
        track = self.convert(made.dataflash_log(), origin=HERE)
        self.assertEqual((track.frame, track.source, self.warned), ("NED_FRD", "ATT+POS", []))
        self.assert_way(track, range(49))  # the last attitude has no position behind it

    def test_the_simulators_truth_goes_first_and_any_source_can_be_asked_for(self):
        log = made.dataflash_log(("ATT", "POS", "XKF1", "SIM"))
        self.assertEqual(self.convert(log).source, "SIM")
        self.assert_way(self.convert(log, source="SIM", origin=HERE), range(50))
        core = self.convert(log, source="XKF1")
        self.assert_way(core, range(50))
        self.assertIn("origin: 47.60000000,-122.33000000,10.000", core.comments)
        self.assertAlmostEqual(self.convert(log, source="XKF1:1").rows[0].position_m[2], 102)
        with self.assertRaisesRegex(ConvertError, r"no poses of 'AHR2'; there is SIM \(50 poses\), XKF1 "):
            self.convert(log, source="AHR2")

    def test_an_origin_that_is_not_the_logs_moves_local_metres(self):
        other = Geodetic(*made.degrees_at(-30, 20, 0))
        row = self.convert(made.dataflash_log(("XKF1",)), origin=other).rows[0]
        for got, wanted in zip(row.position_m, (30, -20, 2)):
            self.assertAlmostEqual(got, wanted, delta=0.01)

    def test_without_an_origin_the_first_fix_is_it(self):
        track = self.convert(made.dataflash_log())
        self.assertEqual(track.comments, ["origin: 47.60000000,-122.33000000,8.000 (the first fix)"])
        self.assert_way(track, range(49), origin_down=2)

    def test_a_log_cut_off_is_read_to_its_end(self):
        log = made.dataflash_log(("SIM",))
        track = self.convert(log[:-20])
        self.assertEqual(len(track.rows), 49)
        self.assertRegex(self.warned[0], rf"ends within a message, at byte {len(log) - 45}")

    def test_garbage_within_is_passed_over(self):
        log, begin = made.dataflash_log(("SIM",)), len(made.dataflash_log(("SIM",), 10))
        track = self.convert(log[:begin] + b"\xa3\x95\xee" + bytes(500) + log[begin:])
        self.assertEqual(len(track.rows), 50)
        self.assertRegex(self.warned[0], f"503 bytes are no message, the first at byte {begin}")

    def test_a_description_that_contradicts_itself_is_left_out(self):
        log = made.dataflash_log(("SIM",)).replace(made.dataflash_format("SIM"), made.dataflash_format("SIM", 48))
        with self.assertRaisesRegex(ConvertError, "no poses"):
            self.convert(log)
        self.assertIn("SIM contradicts itself", self.warned[0])

    def test_old_logs_count_milliseconds(self):
        old = {"SIM": (13, "IccCfLL", "TimeMS,Roll,Pitch,Yaw,Alt,Lat,Lng", "IhhHfii")}
        with mock.patch.dict(made.DATAFLASH, old):
            log = made.dataflash_format("SIM") + b"".join(
                made.dataflash_message("SIM", 500 * i, 0, 0, 9000, -3.0, 476000000, -1223300000) for i in range(3))
        track = self.convert(log, origin=Geodetic(47.6, -122.33, 0))
        self.assertEqual([row.t_s for row in track.rows], [0, 0.5, 1])
        self.assertAlmostEqual(track.rows[0].position_m[2], 3, places=5)
        self.assertAlmostEqual(track.rows[0].orientation[3], math.sqrt(0.5), places=6)


class Telemetry(WithFolder):
    def test_attitudes_meet_positions_by_the_vehicles_clock(self):
        for version in (1, 2):
            for attitude in ("ATTITUDE", "ATTITUDE_QUATERNION"):
                with self.subTest(attitude, version=version):
                    track = self.convert(made.telemetry_log((attitude, "LOCAL_POSITION_NED"), version=version))
                    self.assertEqual((track.source, self.warned), (f"{attitude}+LOCAL_POSITION_NED", []))
                    self.assert_way(track, range(49), t0=25, metres=1e-5, radians=1e-5)
                    self.assertEqual(track.comments[0], "origin: 47.60000000,-122.33000000,10.000")

    def test_a_vehicle_that_starts_again_goes_on_in_time(self):
        again = made.telemetry_log(began_s=1_700_000_060, boot_s=3)
        rows = self.convert(made.telemetry_log() + again).rows
        self.assertEqual(len(rows), 99)  # one between the two: a position on either side of it
        self.assertAlmostEqual(rows[-1].t_s - rows[0].t_s, 64.8, delta=0.02)
        self.assertIn("started again (1 x)", self.warned[0])

    def test_what_is_better_goes_first(self):
        all_of_it = ("ATTITUDE", "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "SIM_STATE", "ODOMETRY")
        log = made.telemetry_log(all_of_it)
        self.assertEqual(self.convert(log).source, "ODOMETRY")
        self.assert_way(self.convert(log), range(50), t0=25, metres=1e-5, radians=1e-5)
        truth = self.convert(log, source="SIM_STATE", origin=HERE)
        self.assert_way(truth, range(50), t0=1_700_000_000, radians=1e-5)  # it has no time: that of arrival
        self.assert_way(self.convert(log, source="ATTITUDE+GLOBAL_POSITION_INT", origin=HERE), range(49), t0=25)

    def test_of_several_systems_one_is_taken_and_the_choice_is_told(self):
        other = bytearray()
        for step in range(10):
            t, north, east, down, *angles = made.moment(step)
            stamp = round(1e6 * (1_700_000_100 + t)).to_bytes(8, "big")
            other += stamp + made.mavlink_frame("ATTITUDE", (step, *angles, 0, 0, 0), system=2)
            other += stamp + made.mavlink_frame("LOCAL_POSITION_NED", (step, north, east, down, 0, 0, 0), system=2)
        both = made.telemetry_log() + bytes(other)
        self.assertEqual(len(self.convert(both).rows), 49)
        self.assertIn("taking 1, which has most", self.warned[0])
        self.assertEqual(len(self.convert(both, system=2).rows), 10)
        with self.assertRaisesRegex(ConvertError, "system 9 does not occur; there are 1, 2, 255"):
            self.convert(both, system=9)

    def test_the_known_value_of_the_checksum(self):
        self.assertEqual(crc(b"12345678", ord("9")), 0x6F91)  # of CRC-16/MCRF4XX

    def test_frames_of_tank_cameras_and_signed_ones(self):
        t, north, east, down, *angles = made.moment(0)
        for name, values in (("ATT_POS_MOCAP", (0, *made.quaternion(*angles), north, east, down, *[0] * 21)),
                             ("VISION_POSITION_ESTIMATE", (0, north, east, down, *angles, *[0] * 21, 5))):
            with self.subTest(name):
                frame = made.mavlink_frame(name, values, signed=True)
                track = self.convert(round(1e6 * 77).to_bytes(8, "big") + frame, kind="tlog")
                self.assert_way(track, range(1), t0=77, metres=1e-6, radians=1e-6)

    def test_broken_frames_cost_only_themselves(self):
        log = bytearray(made.telemetry_log(("ODOMETRY",)))
        middle = log.index(b"\xfd", len(log) // 2) + 30
        log[middle] ^= 0x10
        track = self.convert(bytes(log))
        self.assertEqual(len(track.rows), 49)
        self.assertRegex(self.warned[0], "bytes are no intact frame, the first at byte [0-9]+")
        track = self.convert(bytes(log[:-5]))
        self.assertEqual(len(track.rows), 48)
        self.assertIn("ends within a frame", self.warned[0])

    def test_odometry_in_other_frames_is_left_out_and_told(self):
        t, north, east, down, *angles = made.moment(3)
        values = (3, north, east, down, *made.quaternion(*angles), *[0] * 6, 21, 8, 0, 0, 0)
        with self.assertRaises(ConvertError):
            self.convert(bytes(8) + made.mavlink_frame("ODOMETRY", values))


class Recordings(WithFolder):
    def channel(self, maker, schema, topic="/odom", encoding="cdr", steps=30, **how):
        return topic, encoding, schema, [(5000 + made.STEP_S * i, maker(i, **how)) for i in range(steps)]

    def test_every_ros_message_with_a_pose(self):
        for maker, schema, topic in ((made.odometry, "nav_msgs/msg/Odometry", "/odom"),
                                     (made.pose_stamped, "geometry_msgs/msg/PoseStamped", "/odom"),
                                     (made.transforms, "tf2_msgs/msg/TFMessage", "/odom odom->base_link")):
            for how in ({}, {"big": True}, {"ros1": True}):
                with self.subTest(schema, **how):
                    encoding = "ros1" if how.get("ros1") else "cdr"
                    track = self.convert(made.mcap([self.channel(maker, schema, encoding=encoding, **how)]), topic=topic)
                    self.assertEqual((track.frame, track.source, self.warned), ("ENU_FLU", topic, []))
                    self.assert_way(track, range(30), t0=100, metres=1e-9, radians=1e-6)

    def test_without_a_stamp_the_time_of_recording_counts(self):
        data = made.mcap([self.channel(made.pose_stamped, "geometry_msgs/msg/PoseStamped", t0=0)], chunked=False)
        self.assert_way(self.convert(data), range(30), t0=5000, radians=1e-6)

    def test_odometry_goes_before_poses_and_doubt_is_an_error(self):
        odometry = self.channel(made.odometry, "nav_msgs/msg/Odometry")
        pose = self.channel(made.pose_stamped, "geometry_msgs/msg/PoseStamped", "/pose")
        self.assertEqual(self.convert(made.mcap([pose, odometry])).source, "/odom")
        self.assertEqual(self.convert(made.mcap([pose, odometry]), topic="/pose").source, "/pose")
        second = self.channel(made.odometry, "nav_msgs/msg/Odometry", "/other")
        with self.assertRaisesRegex(ConvertError, r"'/odom' \(30 poses\), '/other' \(30 poses\); say which"):
            self.convert(made.mcap([odometry, second]))
        with self.assertRaisesRegex(ConvertError, "no poses on topic '/nowhere'"):
            self.convert(made.mcap([odometry]), topic="/nowhere")
        with self.assertRaisesRegex(ConvertError, "no poses: no message"):
            self.convert(made.mcap([self.channel(made.odometry, "sensor_msgs/msg/Imu")]))

    def test_json_poses(self):
        def line(step):
            t, north, east, down, roll, pitch, yaw = made.moment(step)
            return json.dumps({"timestamp": t, "position": [north, east, down], "attitude": [roll, pitch, yaw]}).encode()

        def nested(step):
            t, (x, y, z), (a, b, c, d) = made.enu_moment(step)
            pose = {"position": {"x": x, "y": y, "z": z}, "orientation": {"x": a, "y": b, "z": c, "w": d}}
            return json.dumps({"header": {"stamp": {"sec": 100, "nanosec": round(1e9 * t)}}, "pose": {"pose": pose}}).encode()

        track = self.convert(made.mcap([self.channel(line, "", encoding="json")]))
        self.assertEqual(track.frame, "NED_FRD")
        self.assert_way(track, range(30), radians=1e-6)
        track = self.convert(made.mcap([self.channel(nested, "Pose", encoding="json")]))
        self.assertEqual(track.frame, "ENU_FLU")
        self.assert_way(track, range(30), t0=100, radians=1e-6)

    def test_a_recording_of_sonard_itself(self):
        """The texts are those of docs/recording.md: pictures beside poses."""
        def pose(step):
            t, (x, y, z), (a, b, c, d) = made.enu_moment(step)
            return (f'{{"timestamp":{{"sec":100,"nsec":{round(1e9 * t)}}},"frame_id":"world","pose":'
                    f'{{"position":{{"x":{x},"y":{y},"z":{z}}},"orientation":{{"x":{a},"y":{b},"z":{c},"w":{d}}}}}}}').encode()

        image = self.channel(lambda step: b'{"data":"' + bytes(1000) + b'"}', "foxglove.RawImage", "/front/image", "json", 10)
        log = made.mcap([image, self.channel(pose, "foxglove.PoseInFrame", "/front/pose", "json", 10)])
        track = self.convert(log)
        self.assertEqual((track.source, track.frame, self.warned), ("/front/pose", "ENU_FLU", []))
        self.assert_way(track, range(10), t0=100, radians=1e-6)

    def test_poses_of_the_foxglove_schemas(self):
        def part(field, content):
            return bytes((field << 3 | 2, len(content))) + content

        def doubles(values):
            return b"".join(bytes((i << 3 | 1,)) + struct.pack("<d", v) for i, v in enumerate(values, 1) if v)

        def in_frame(step):
            _, position, xyzw = made.enu_moment(step)
            return part(1, b"\x08\x64\x10\x07") + part(2, b"map") + part(3, part(1, doubles(position)) + part(2, doubles(xyzw)))

        def transform(step):
            _, position, xyzw = made.enu_moment(step)
            return part(2, b"map") + part(3, b"rov") + part(4, doubles(position)) + part(5, doubles(xyzw))

        track = self.convert(made.mcap([self.channel(in_frame, "foxglove.PoseInFrame", encoding="protobuf", steps=1)]))
        self.assert_way(track, range(1), t0=100, radians=1e-6)
        track = self.convert(made.mcap([self.channel(transform, "foxglove.FrameTransform", encoding="protobuf")]))
        self.assertEqual(track.source, "/odom map->rov")
        self.assert_way(track, range(30), t0=5000, radians=1e-6)

    def test_a_recording_that_was_not_closed_or_breaks_off(self):
        data = made.mcap([self.channel(made.odometry, "nav_msgs/msg/Odometry")], closed=False)
        self.assertEqual(len(self.convert(data).rows), 30)
        self.assertIn("was not closed", self.warned[0])
        self.assertEqual(len(self.convert(data[:-1]).rows), 20)
        self.assertRegex(self.warned[0], "ends within a record, at byte [0-9]+")

    def test_a_chunk_whose_checksum_is_wrong_is_left_out(self):
        data = bytearray(made.mcap([self.channel(made.odometry, "nav_msgs/msg/Odometry")]))
        data[len(data) // 2] ^= 1
        self.assertEqual(len(self.convert(bytes(data)).rows), 20)
        self.assertRegex(self.warned[0], "at byte [0-9]+: a chunk cannot be read: the checksum .* 1 chunks were left out")

    def test_a_message_that_is_too_short_is_named(self):
        channel = self.channel(made.odometry, "nav_msgs/msg/Odometry")
        channel[3][4] = (channel[3][4][0], channel[3][4][1][:60])
        self.assertEqual(len(self.convert(made.mcap([channel])).rows), 29)
        self.assertRegex(self.warned[0], "at byte [0-9]+, topic /odom: ends after 60 bytes")

    def test_compressed_chunks_need_their_module(self):
        class Backwards:  # stands for a module that may not be here
            @staticmethod
            def decompress(data):
                return data[::-1]
        data = made.mcap([self.channel(made.odometry, "nav_msgs/msg/Odometry")], compress=("lz4", lambda d: d[::-1]))
        with mock.patch.object(compression, "_module", lambda *names: Backwards if names == ("lz4.frame",) else None):
            self.assertEqual(len(self.convert(data).rows), 30)
        for kind, package in (("lz4", "python3-lz4"), ("zstd", "python3-zstandard")):
            data = made.mcap([self.channel(made.odometry, "nav_msgs/msg/Odometry")], compress=(kind, lambda d: d[::-1]))
            with mock.patch.object(compression, "_module", lambda *names: None), \
                    self.assertRaisesRegex(ConvertError, f"at byte [0-9]+: a chunk is compressed by {kind}: install {package}"):
                self.convert(data)
        with self.assertRaisesRegex(ConvertError, "compressed by 'rar', which is not known"):
            self.convert(made.mcap([self.channel(made.odometry, "nav_msgs/msg/Odometry")], compress=("rar", lambda d: d)))

    def test_bags(self):
        told = [(5000 + made.STEP_S * i, made.odometry(i, ros1=True)) for i in range(30)]
        for kind, pack in (("none", lambda d: d), ("bz2", bz2.compress)):
            with self.subTest(kind):
                data = made.bag([("/odom", "nav_msgs/Odometry", told), ("/imu", "sensor_msgs/Imu", [(1, b"")])], kind, pack)
                track = self.convert(data)
                self.assertEqual((track.frame, track.source, self.warned), ("ENU_FLU", "/odom", []))
                self.assert_way(track, range(30), t0=100, metres=1e-9, radians=1e-6)
        with self.assertRaisesRegex(ConvertError, "no poses"):
            self.convert(data[:-10])
        self.assertIn("ends within a record", self.warned[0])


class Nmea(WithFolder):
    def test_a_pose_at_every_fix(self):
        track = self.convert(made.nmea_log(), origin=HERE, assumed=self.assumed(bottom_m=20))
        self.assertEqual(self.warned, [])
        self.assert_way(track, range(20), t0=43200, radians=1e-6)
        self.assertEqual(self.convert(made.nmea_log()).comments, ["origin: 47.60000000,-122.33000000,0.000 (the first fix)"])
        self.assertIn("DPT and DBT are the water below it", self.warned[0])

    @staticmethod
    def assumed(**what):
        return Assumptions(**what)

    def test_times_go_on_past_midnight(self):
        rows = self.convert(made.nmea_log(began_s=86399)).rows
        self.assertAlmostEqual(rows[-1].t_s - rows[0].t_s, 1.9)

    def test_lines_that_are_none_are_told_with_their_place(self):
        log = made.nmea_log().replace("HEHDT,28.6", "HEHDT,29.6", 1)
        log = log[:400] + "noise\r\n" + log[400:]
        self.convert(log, kind="nmea")
        self.assertRegex(self.warned[0], r"at byte 0: checksum '..' where .. is right; [2-4] lines were left out")
        with self.assertRaisesRegex(ConvertError, "no heading"):
            self.convert(made.nmea_log(kinds=("GGA",)))


class Anything(WithFolder):
    """Whatever happens to a log, the answer is poses or one sentence that names the file."""

    LOGS = {"dataflash": made.dataflash_log(("ATT", "POS", "SIM"), 4), "tlog": made.telemetry_log(("ATTITUDE", "ODOMETRY"), 3),
            "mcap": made.mcap([("/odom", "cdr", "nav_msgs/msg/Odometry", [(i, made.odometry(i)) for i in range(4)]),
                               ("/tf", "cdr", "tf2_msgs/msg/TFMessage", [(1, made.transforms(1))])], 2),
            "rosbag": made.bag([("/odom", "nav_msgs/Odometry", [(i, made.odometry(i, ros1=True)) for i in range(3)])]),
            "nmea": made.nmea_log(3, kinds=("HDT", "PRDID", "GGA", "RMC")).encode()}

    def outcome(self, kind, data):
        try:
            self.assertTrue(self.convert(data, kind=kind).rows)
        except ConvertError as error:
            self.assertIn(str(self.folder / "log"), str(error))

    def test_cut_off_anywhere(self):
        for kind, log in self.LOGS.items():
            self.assertEqual(format_of(self.file(log)), kind)
            for length in range(0, len(log), 1 + len(log) // 150):
                with self.subTest(kind, length=length):
                    self.outcome(kind, log[:length])

    def test_bytes_changed_anywhere(self):
        draw = random.Random(1)
        for kind, log in self.LOGS.items():
            for number in range(150):
                data = bytearray(log)
                for _ in range(draw.choice((1, 3, 20))):
                    data[draw.randrange(len(data))] = draw.choice((0, 0xFF, draw.randrange(256)))
                with self.subTest(kind, number=number):
                    self.outcome(kind, bytes(data))

    def test_what_is_no_log(self):
        for data in (b"", b"\x7fELF" + bytes(100), b"time,x,y\n1,2,3\n"):
            with self.subTest(data[:8]), self.assertRaises(ConvertError):
                format_of(self.file(data))


class Command(WithFolder):
    def said(self, *words):
        out, error = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
            code = main([str(w) for w in words])
        return code, out.getvalue(), error.getvalue()

    def test_the_file_that_comes_out(self):
        log, target = self.file(made.dataflash_log(("SIM",), 3), "flight.bin"), self.folder / "way.csv"
        code, _, text = self.said(log, "-o", target, "--origin", "47.6,-122.33,10", "--body", "rov")
        self.assertEqual(code, 0, text)
        self.assertIn("flight.bin: 3 poses of SIM over 0.2 s, NED_FRD", text)
        lines = target.read_text(encoding="utf-8").splitlines()
        self.assertEqual(lines[:5], ["# frame: NED_FRD", "# source: SIM", "# origin: 47.60000000,-122.33000000,10.000",
                                     "# t = 0 was 0.000000 s", "t,x,y,z,qw,qx,qy,qz,body"])
        self.assertEqual([line.split(",")[0] for line in lines[5:]], ["0.000000000", "0.100000000", "0.200000000"])
        self.assertTrue(all(line.endswith(",rov") for line in lines[5:]))
        self.assertEqual(list(self.folder.glob("*.part")), [])

    def test_the_logs_own_times(self):
        log = self.file(made.telemetry_log(("SIM_STATE",), 3), "flight.tlog")
        code, text, _ = self.said(log, "-o", "-", "--keep-time")
        self.assertEqual(code, 0)
        self.assertEqual(text.splitlines()[-3].split(",")[0], "1700000000.000000000")

    def test_another_frame_for_a_recording(self):
        log = self.file(made.mcap([("/odom", "cdr", "nav_msgs/msg/Odometry", [(i, made.odometry(i)) for i in range(3)])]))
        self.assertTrue(self.said(log, "-o", "-", "--frame", "NED_FRD")[1].startswith("# frame: NED_FRD"))
        self.assertEqual(self.said(self.file(made.dataflash_log()), "-o", "-", "--frame", "ENU_FLU")[0], 64)

    def test_gaps_are_told(self):
        late = made.dataflash_message("SIM", 9000000, 0, 0, 0, 0, 476000000, -1223300000, 1, 0, 0, 0)
        log = made.dataflash_log(("SIM",), 3) + late
        self.assertIn("no pose for 8.8 s after second 0.2", self.said(self.file(log), "-o", "-")[2])

    def test_what_goes_wrong_has_its_code(self):
        log = self.file(made.dataflash_log(("SIM",), 3))
        self.assertEqual(self.said(self.folder / "none.bin", "-o", "-")[0], 66)
        self.assertEqual(self.said(log, "-o", self.folder / "no" / "folder.csv")[0], 66)
        self.assertEqual(self.said(log, "-o", "-", "--origin", "x")[0], 64)
        self.assertEqual(self.said(log, "-o", "-", "--body", "a b")[0], 64)
        self.assertEqual(self.said(self.file(b"\x7fELF"), "-o", "-")[0], 65)


if __name__ == "__main__":
    unittest.main()
