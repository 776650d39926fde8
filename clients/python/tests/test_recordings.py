"""Conversion of MCAP and ROS 1 bags: all messages with poses; compressed, truncated and corrupted files."""
import bz2
import json
import struct
import tracemalloc
import unittest
from unittest import mock

import made_logs as made
from converted import WithFolder

from sonard_client.convert import ConvertError, compression


class ModuleStandIn:
    """Replaces lz4.frame and compression.zstd, which may not be installed. It decompresses by reversing the bytes."""
    class LZ4FrameDecompressor:
        eof = True

        @staticmethod
        def decompress(data, max_length=-1):
            return data[::-1] if max_length < 0 else data[::-1][:max_length]

    ZstdDecompressor = LZ4FrameDecompressor


class Decompression(unittest.TestCase):
    BOMB = bytes(64 << 20)

    def refused(self, kind, packed):
        """If the declared size is too small, memory stays limited to that size and the decompressor's own need."""
        tracemalloc.start()
        try:
            with self.assertRaisesRegex(compression.Unreadable, "decompresses to more than the declared 1000 bytes"):
                compression.unpack(kind, packed, 1000)
            self.assertLess(tracemalloc.get_traced_memory()[1], 16 << 20)
        finally:
            tracemalloc.stop()

    def complete_truncated_or_too_short(self, kind, pack):
        data = bytes(range(250)) * 4
        self.assertEqual(compression.unpack(kind, pack(data), 1000), data)
        for packed in (pack(data)[:-5], pack(data[:-1]), b"", b"not compressed data"):
            with self.subTest(kind, packed=packed[-10:]), self.assertRaises(compression.Unreadable):
                compression.unpack(kind, packed, 1000)

    def test_bz2_is_decompressed(self):
        self.complete_truncated_or_too_short("bz2", bz2.compress)
        self.refused("bz2", bz2.compress(self.BOMB))

    def test_lz4_is_decompressed(self):
        lz4 = compression._module("lz4.frame")
        if lz4 is None:
            self.skipTest("python3-lz4 is not installed")
        self.complete_truncated_or_too_short("lz4", lz4.compress)
        self.refused("lz4", lz4.compress(self.BOMB))

    def test_zstd_is_decompressed(self):
        zstd = compression._module("compression.zstd", "zstandard")
        if zstd is None:
            self.skipTest("python3-zstandard is not installed")
        self.complete_truncated_or_too_short("zstd", zstd.compress)
        self.refused("zstd", zstd.compress(self.BOMB))

    def test_modules_are_limited_to_the_declared_size(self):
        for kind, module in (("lz4", "lz4.frame"), ("zstd", "compression.zstd")):
            with self.subTest(kind), \
                    mock.patch.object(compression, "_module", lambda *names, m=module: ModuleStandIn if m in names else None):
                self.assertEqual(compression.unpack(kind, b"cba", 3), b"abc")
                self.refused(kind, bytes(2000))


def part(field, content):
    return bytes((field << 3 | 2, len(content))) + content


def doubles(values):
    return b"".join(bytes((i << 3 | 1,)) + struct.pack("<d", v) for i, v in enumerate(values, 1) if v)


def in_frame(step):
    """foxglove.PoseInFrame in protobuf, 7 ns after 100 s."""
    _, position, xyzw = made.enu_moment(step)
    return part(1, b"\x08\x64\x10\x07") + part(2, b"map") + part(3, part(1, doubles(position)) + part(2, doubles(xyzw)))


class Recordings(WithFolder):
    def channel(self, maker, schema, topic="/odom", encoding="cdr", steps=30, **how):
        return topic, encoding, schema, [(5000 + made.STEP_S * i, maker(i, **how)) for i in range(steps)]

    def test_frames_with_ned_in_their_name_are_ned(self):
        def in_ned(step, frame):
            t, north, east, down, *angles = made.moment(step)
            w, x, y, z = made.quaternion(*angles)
            return made.Cdr().header(100 + t, frame).put("d", north, east, down, x, y, z, w).done()
        for frame, axes in (("world_ned", "NED_FRD"), ("odom_NED", "NED_FRD"), ("ned", "NED_FRD"), ("planned_path", "ENU_FLU")):
            with self.subTest(frame):
                maker = in_ned if axes == "NED_FRD" else lambda step, frame: made.pose_stamped(step)
                track = self.convert(made.mcap([self.channel(maker, "geometry_msgs/msg/PoseStamped", frame=frame)]))
                self.assertEqual(track.frame, axes)
                self.assert_track(track, range(30), t0=100, metres=1e-9, radians=1e-6)
                said = [f"its poses are in the frame {frame!r}, so the axes are NED_FRD; --frame ENU_FLU if they are not"]
                self.assertEqual(self.warned, said if axes == "NED_FRD" else [])

    def test_axes_that_the_user_names_are_not_guessed(self):
        poses = [(5000 + i, made.pose_stamped(i, frame="world_ned")) for i in range(3)]
        ros1 = [(5000 + i, made.pose_stamped(i, frame="world_ned", ros1=True)) for i in range(3)]
        recordings = {"mcap": made.mcap([("/pose", "cdr", "geometry_msgs/msg/PoseStamped", poses)]),
                      "rosbag": made.bag([("/pose", "geometry_msgs/PoseStamped", ros1)]),
                      "db3": made.db3(self.folder / "made", [("/pose", "geometry_msgs/msg/PoseStamped", poses)]).read_bytes()}
        for kind, recording in recordings.items():
            with self.subTest(kind):
                self.assertEqual((self.convert(recording, kind=kind).frame, len(self.warned)), ("NED_FRD", 1))
                for axes in ("ENU_FLU", "NED_FRD"):
                    self.assertEqual((self.convert(recording, kind=kind, frame=axes).frame, self.warned), (axes, []))
                with self.assertRaisesRegex(ValueError, "frame is 'up': it must be one of"):
                    self.convert(recording, kind=kind, frame="up")

    def test_every_ros_message_with_a_pose_is_read(self):
        for maker, schema, topic in ((made.odometry, "nav_msgs/msg/Odometry", "/odom"),
                                     (made.pose_stamped, "geometry_msgs/msg/PoseStamped", "/odom"),
                                     (made.transforms, "tf2_msgs/msg/TFMessage", "/odom odom->base_link")):
            for how in ({}, {"big": True}, {"ros1": True}):
                with self.subTest(schema, **how):
                    encoding = "ros1" if how.get("ros1") else "cdr"
                    track = self.convert(made.mcap([self.channel(maker, schema, encoding=encoding, **how)]), topic=topic)
                    self.assertEqual((track.frame, track.source, self.warned), ("ENU_FLU", topic, []))
                    self.assert_track(track, range(30), t0=100, metres=1e-9, radians=1e-6)

    def test_default_time_is_that_of_recording(self):
        data = made.mcap([self.channel(made.pose_stamped, "geometry_msgs/msg/PoseStamped", t0=0)], chunked=False)
        self.assert_track(self.convert(data), range(30), t0=5000, radians=1e-6)

    def test_odometry_is_preferred_and_ambiguity_is_an_error(self):
        odometry = self.channel(made.odometry, "nav_msgs/msg/Odometry")
        pose = self.channel(made.pose_stamped, "geometry_msgs/msg/PoseStamped", "/pose")
        self.assertEqual(self.convert(made.mcap([pose, odometry])).source, "/odom")
        self.assertEqual(self.convert(made.mcap([pose, odometry]), topic="/pose").source, "/pose")
        second = self.channel(made.odometry, "nav_msgs/msg/Odometry", "/other")
        with self.assertRaisesRegex(ConvertError, r"'/odom' \(30 poses\), '/other' \(30 poses\); select one"):
            self.convert(made.mcap([odometry, second]))
        with self.assertRaisesRegex(ConvertError, "no poses on topic '/nowhere'"):
            self.convert(made.mcap([odometry]), topic="/nowhere")
        with self.assertRaisesRegex(ConvertError, "no poses found: expected"):
            self.convert(made.mcap([self.channel(made.odometry, "sensor_msgs/msg/Imu")]))

    def test_json_poses_are_read(self):
        def line(step):
            t, north, east, down, roll, pitch, yaw = made.moment(step)
            return json.dumps({"timestamp": t, "position": [north, east, down], "attitude": [roll, pitch, yaw]}).encode()

        def nested(step):
            t, (x, y, z), (a, b, c, d) = made.enu_moment(step)
            pose = {"position": {"x": x, "y": y, "z": z}, "orientation": {"x": a, "y": b, "z": c, "w": d}}
            return json.dumps({"header": {"stamp": {"sec": 100, "nanosec": round(1e9 * t)}}, "pose": {"pose": pose}}).encode()

        track = self.convert(made.mcap([self.channel(line, "", encoding="json")]))
        self.assertEqual(track.frame, "NED_FRD")
        self.assert_track(track, range(30), radians=1e-6)
        track = self.convert(made.mcap([self.channel(nested, "Pose", encoding="json")]))
        self.assertEqual(track.frame, "ENU_FLU")
        self.assert_track(track, range(30), t0=100, radians=1e-6)

    def test_a_recording_of_sonard_is_read(self):
        """Images, poses and frames in protobuf, as in docs/recording.md, and in JSON, as before."""
        def pose(step):
            t, (x, y, z), (a, b, c, d) = made.enu_moment(step)
            return (f'{{"timestamp":{{"sec":100,"nsec":{round(1e9 * t)}}},"frame_id":"world","pose":'
                    f'{{"position":{{"x":{x},"y":{y},"z":{z}}},"orientation":{{"x":{a},"y":{b},"z":{c},"w":{d}}}}}}}').encode()

        frames = self.channel(lambda step: part(1, b"\x00"), "foxglove.FrameTransforms", "/tf", "protobuf", 1)
        for encoding, maker, steps in (("json", pose, 10), ("protobuf", in_frame, 1)):
            with self.subTest(encoding):
                image = self.channel(lambda step: b'{"data":"' + bytes(1000) + b'"}', "foxglove.RawImage", "/front/image", encoding, 10)
                poses = self.channel(maker, "foxglove.PoseInFrame", "/front/pose", encoding, steps)
                track = self.convert(made.mcap([image, poses, frames]))
                self.assertEqual((track.source, track.frame, self.warned), ("/front/pose", "ENU_FLU", []))
                self.assert_track(track, range(steps), t0=100, radians=1e-6)

    def test_poses_of_the_foxglove_schemas_are_read(self):
        def transform(step):
            _, position, xyzw = made.enu_moment(step)
            return part(2, b"map") + part(3, b"rov") + part(4, doubles(position)) + part(5, doubles(xyzw))

        track = self.convert(made.mcap([self.channel(in_frame, "foxglove.PoseInFrame", encoding="protobuf", steps=1)]))
        self.assert_track(track, range(1), t0=100, radians=1e-6)
        track = self.convert(made.mcap([self.channel(transform, "foxglove.FrameTransform", encoding="protobuf")]))
        self.assertEqual(track.source, "/odom map->rov")
        self.assert_track(track, range(30), t0=5000, radians=1e-6)

    def test_unclosed_and_truncated_recordings_are_read(self):
        data = made.mcap([self.channel(made.odometry, "nav_msgs/msg/Odometry")], closed=False)
        self.assertEqual(len(self.convert(data).rows), 30)
        self.assertIn("was not closed", self.warned[0])
        self.assertEqual(len(self.convert(data[:-1]).rows), 20)
        self.assertRegex(self.warned[0], "ends within a record, at byte [0-9]+")

    def test_chunk_with_wrong_checksum_is_omitted(self):
        data = bytearray(made.mcap([self.channel(made.odometry, "nav_msgs/msg/Odometry")]))
        data[len(data) // 2] ^= 1
        self.assertEqual(len(self.convert(bytes(data)).rows), 20)
        self.assertRegex(self.warned[0], "at byte [0-9]+: a chunk cannot be read: its checksum is wrong; chunks omitted: 1")

    def test_short_message_is_reported(self):
        channel = self.channel(made.odometry, "nav_msgs/msg/Odometry")
        channel[3][4] = (channel[3][4][0], channel[3][4][1][:60])
        self.assertEqual(len(self.convert(made.mcap([channel])).rows), 29)
        self.assertRegex(self.warned[0], "at byte [0-9]+, topic /odom: ends after 60 bytes")

    def test_compressed_chunks_need_their_module(self):
        data = made.mcap([self.channel(made.odometry, "nav_msgs/msg/Odometry")], compress=("lz4", lambda d: d[::-1]))
        with mock.patch.object(compression, "_module", lambda *names: ModuleStandIn if names == ("lz4.frame",) else None):
            self.assertEqual(len(self.convert(data).rows), 30)
        for kind, package in (("lz4", "python3-lz4"), ("zstd", "python3-zstandard")):
            data = made.mcap([self.channel(made.odometry, "nav_msgs/msg/Odometry")], compress=(kind, lambda d: d[::-1]))
            with mock.patch.object(compression, "_module", lambda *names: None), \
                    self.assertRaisesRegex(ConvertError, f"at byte [0-9]+: a chunk is compressed by {kind}: install {package}"):
                self.convert(data)
        with self.assertRaisesRegex(ConvertError, "compressed by 'rar', which is not supported"):
            self.convert(made.mcap([self.channel(made.odometry, "nav_msgs/msg/Odometry")], compress=("rar", lambda d: d)))

    def test_bags_are_read(self):
        logged = [(5000 + made.STEP_S * i, made.odometry(i, ros1=True)) for i in range(30)]
        for kind, pack in (("none", lambda d: d), ("bz2", bz2.compress)):
            with self.subTest(kind):
                data = made.bag([("/odom", "nav_msgs/Odometry", logged), ("/imu", "sensor_msgs/Imu", [(1, b"")])], kind, pack)
                track = self.convert(data)
                self.assertEqual((track.frame, track.source, self.warned), ("ENU_FLU", "/odom", []))
                self.assert_track(track, range(30), t0=100, metres=1e-9, radians=1e-6)
        with self.assertRaisesRegex(ConvertError, "no poses"):
            self.convert(data[:-10])
        self.assertIn("ends within a record", self.warned[0])


if __name__ == "__main__":
    unittest.main()
