"""Conversion of recordings of ROS 2, .db3 files and folders. Poses are compared with their source. A damaged file gives one
error."""
import contextlib
import shutil
import sqlite3
import struct
import unittest
from unittest import mock

import made_logs as made
from converted import WithFolder

from sonard_client.convert import ConvertError, compression, convert, format_of, rosbag2
from sonard_client.convert.rosbag2 import files_of


class RecordingsOfRos2(WithFolder):
    def test_a_file_is_read(self):
        path = made.db3(self.folder / "odom #1 50%.db3", made.ROS2_TOPICS)
        self.assertEqual(format_of(path), "db3")
        track = convert(path, warn=self.warned.append)
        self.assertEqual((track.source, track.frame, self.warned), ("/odom", "ENU_FLU", []))
        self.assert_track(track, range(5), t0=100, metres=1e-9, radians=1e-6)
        with self.assertRaisesRegex(ConvertError, r"no poses on topic '/pose'; topics with poses: '/odom' \(5 poses\)"):
            convert(path, topic="/pose")

    def test_topics_that_are_there_are_listed_if_none_has_poses(self):
        topics = [("/image", "sensor_msgs/msg/Image", [(100, b"not read")]), ("/imu", "sensor_msgs/msg/Imu", [])]
        wanted = r"its topics: '/image' \(sensor_msgs/msg/Image\), '/imu' \(sensor_msgs/msg/Imu\)$"
        with self.assertRaisesRegex(ConvertError, wanted):
            convert(made.db3(self.folder / "a.db3", topics))
        with self.assertRaisesRegex(ConvertError, wanted):
            self.convert(made.mcap([(topic, "cdr", kind, logged) for topic, kind, logged in topics]))
        with self.assertRaisesRegex(ConvertError, r"its topics: '/fix' \(sensor_msgs/NavSatFix\)$"):
            self.convert(made.bag([("/fix", "sensor_msgs/NavSatFix", [(1, b"")])]))
        many = [(f"/{number}", "cdr", "std_msgs/msg/String", [(1, b"")]) for number in range(30)]
        with self.assertRaisesRegex(ConvertError, "and 10 more$"):
            self.convert(made.mcap(many))

    def test_poses_without_a_header_have_the_time_of_the_recording(self):
        messages = [(100 + made.moment(i)[0], made.Cdr().put("d", *made.enu_moment(i)[1], *made.enu_moment(i)[2]).done())
                    for i in range(5)]
        track = self.convert(made.mcap([("/pose", "cdr", "geometry_msgs/msg/Pose", messages)]))
        self.assert_track(track, range(5), t0=100, metres=1e-9, radians=1e-6)

    def test_a_clock_that_goes_back_for_good_is_named(self):
        messages = [(100 + i, made.odometry(i)) for i in range(5)] + [(105 + i, made.odometry(i, t0=1)) for i in range(20)]
        self.assertEqual(len(self.convert(made.mcap([("/odom", "cdr", "nav_msgs/msg/Odometry", messages)])).rows), 5)
        self.assertRegex(self.warned[0], r"omitted .*: 20; the clock went back by 99\.4 s at pose 6: split the recording there$")

    def test_a_simulated_clock_begins_at_0(self):
        """The stamp 0 is a time only beside other small stamps."""
        def recorded(t0s):
            return made.mcap([("/odom", "cdr", "nav_msgs/msg/Odometry",
                               [(1e9 + i, made.odometry(i, t0=t0)) for i, t0 in enumerate(t0s)])])
        self.assert_track(self.convert(recorded([0] * 5)), range(5), metres=1e-9, radians=1e-6)
        self.assertEqual(self.warned, [])
        unset = -made.moment(1)[0]  # the second message has no stamp
        self.assertEqual(len(self.convert(recorded([1e9, unset, 1e9, 1e9])).rows), 3)
        self.assertEqual(self.warned, ["poses omitted because they have no time stamp, which others have: 1"])

    def folder_of(self, *names):
        folder = self.folder / "recording"
        folder.mkdir()
        (folder / "metadata.yaml").write_text("rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n" +
                                              "".join(f"    - {name}\n" for name in names))
        return folder

    def test_a_folder_of_several_files_is_read(self):
        for kind in ("db3", "mcap"):
            with self.subTest(kind):
                folder = self.folder_of(f"r_10.{kind}", f"r_9.{kind}")
                parts = [(f"r_9.{kind}", range(3)), (f"r_10.{kind}", range(3, 6))]  # their times count, not their names
                for name, steps in parts:
                    messages = [(100 + i, made.odometry(i)) for i in steps]
                    if kind == "db3":
                        made.db3(folder / name, [("/odom", "nav_msgs/msg/Odometry", messages)])
                    else:
                        (folder / name).write_bytes(made.mcap([("/odom", "cdr", "nav_msgs/msg/Odometry", messages)]))
                for named in (folder / "metadata.yaml", folder):
                    self.assertEqual(format_of(named), kind)
                    track = convert(named, warn=self.warned.append)
                    self.assertEqual(self.warned, [])
                    self.assert_track(track, range(6), t0=100, metres=1e-9, radians=1e-6)
                (folder / "metadata.yaml").unlink()  # it is missing if the recorder was killed
                self.assert_track(convert(folder), range(6), t0=100, metres=1e-9, radians=1e-6)
                shutil.rmtree(folder)

    def test_folders_without_files_are_refused(self):
        folder = self.folder_of()
        with self.assertRaisesRegex(ConvertError, "a folder without .db3 and .mcap files"):
            format_of(folder)
        (folder / "r_0.db3.zstd").write_bytes(b"x")
        with self.assertRaisesRegex(ConvertError, "r_0.db3.zstd is compressed; unpack it first: zstd -d "):
            format_of(folder)

    def test_parts_that_are_not_read_are_named(self):
        folder = self.folder_of("sub/r_0.db3", "r_1.db3.zstd", "r_2.db3.zstd", "r_3.db3", "'r_\x1b4.mcap'")
        for name in ("r_0.db3", "r_2.db3"):
            made.db3(folder / name, made.ROS2_TOPICS)
        for name in ("r_1.db3.zstd", "r_2.db3.zstd"):
            (folder / name).write_bytes(b"x")
        self.assertEqual([p.name for p in files_of(folder, self.warned.append)], ["r_0.db3", "r_2.db3"])
        self.assertEqual(self.warned, [
            "parts of the recording are compressed, so they are omitted; unpack them first: zstd -d: r_1.db3.zstd",
            "parts of the recording are omitted: metadata.yaml lists them, and they are not in the folder: r_3.db3, r_?4.mcap"])
        self.warned = []
        convert(folder, warn=self.warned.append)
        self.assertEqual(len([text for text in self.warned if "parts of the recording" in text]), 2)

    def test_metadata_of_blank_lines_takes_little_time(self):
        folder = self.folder_of()
        made.db3(folder / "r_0.db3", made.ROS2_TOPICS)
        for text in ("\n" * (1 << 20), " " * (1 << 20), "- " + " " * (1 << 20), "- a.db3" * (1 << 17) + " x", "- \n" * (1 << 18)):
            (folder / "metadata.yaml").write_text(text)
            self.assertEqual(len(files_of(folder)), 1)  # a quadratic search would take hours

    def test_messages_that_are_not_merged_yet_are_read(self):
        path, copy = self.folder / "live.db3", self.folder / "copy.db3"
        made.db3(path, [("/odom", "nav_msgs/msg/Odometry", [(100, made.odometry(0))])])
        with contextlib.closing(sqlite3.connect(path)) as base:
            base.execute("PRAGMA journal_mode=WAL")
            base.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (1, 101000000000, ?)", (made.odometry(1),))
            base.commit()
            for end in ("", "-wal"):
                shutil.copy(f"{path}{end}", f"{copy}{end}")
        self.assertEqual(len(convert(copy).rows), 2)
        self.assertGreater((self.folder / "copy.db3-wal").stat().st_size, 0)

    def test_unfinished_changes_are_ignored(self):
        path, copy = self.folder / "live.db3", self.folder / "copy.db3"
        made.db3(path, made.ROS2_TOPICS)
        with contextlib.closing(sqlite3.connect(path)) as base:
            base.execute("PRAGMA cache_size=1")  # so that pages are written before the end
            base.execute("UPDATE topics SET name = '/half'")
            base.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES (1, 1, ?)", [(bytes(5000),)] * 50)
            for end in ("", "-journal"):
                shutil.copy(f"{path}{end}", f"{copy}{end}")
            base.rollback()
        with self.assertRaisesRegex(ConvertError, "copy.db3: its writer did not end .*: copy.db3-journal belongs to it"):
            convert(copy)

    def test_only_stored_tables_are_read(self):
        endless = "AS WITH RECURSIVE c(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM c) SELECT n AS id, "
        for table, statement, said in (
                ("messages", f"CREATE VIEW messages {endless} 1 AS topic_id, n AS timestamp, x'00' AS data FROM c",
                 "messages is not a stored table"),
                ("topics", f"CREATE VIEW topics {endless} '/a' AS name, 'nav_msgs/msg/Odometry' AS type, 'cdr' AS "
                 "serialization_format FROM c", "topics is not a stored table"),
                ("messages", "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data AS (zeroblob(900000000)))",
                 "column data of messages is not stored")):
            with self.subTest(said):
                path = self.folder / "log"
                path.unlink(missing_ok=True)
                made.db3(path, made.ROS2_TOPICS)
                with contextlib.closing(sqlite3.connect(path)) as base, base:
                    base.execute(f"DROP TABLE {table}")
                    base.execute(statement)
                with self.assertRaisesRegex(ConvertError, f"log: not a recording of ROS 2, or damaged: {said}"):
                    convert(path)

    def repeating(self, topic_id):
        """Writes a file of some kB and returns its path. Its table of messages is a tree that lists the same pages many times."""
        path = self.folder / "log"
        with contextlib.closing(sqlite3.connect(path)) as base:
            base.execute("PRAGMA page_size=512")
            base.execute("VACUUM")
        made.db3(path, [("/odom", "nav_msgs/msg/Odometry", [(i, b"x") for i in range(1000)])])
        with contextlib.closing(sqlite3.connect(path)) as base, base:
            base.execute("UPDATE messages SET topic_id = ?", (topic_id,))
            root, = base.execute("SELECT rootpage FROM sqlite_master WHERE name = 'messages'").fetchone()
        data = bytearray(path.read_bytes())

        def children(page):
            at = 512 * (page - 1)
            cells = struct.unpack_from(">H", data, at + 3)[0]
            self.assertEqual(data[at], 5)  # an inner page
            return [at + 8] + [at + struct.unpack_from(">H", data, at + 12 + 2 * i)[0] for i in range(cells)]

        places = children(root)
        inner, leaf = (struct.unpack_from(">I", data, at)[0] for at in places[:2])
        for level, below in ((root, inner), (inner, leaf)):
            if level == inner:
                data[512 * (inner - 1):512 * inner] = data[512 * (root - 1):512 * root]
            for at in children(level):
                struct.pack_into(">I", data, at, below)
        path.write_bytes(data)
        return path

    def test_tables_longer_than_the_file_are_refused(self):
        for topic_id, steps in ((1, rosbag2.STEPS_PER_BYTE), (2, 0.05)):  # messages of topic 1 are read, of topic 2 skipped
            path = self.repeating(topic_id)
            with self.subTest(topic_id), mock.patch.object(rosbag2, "STEPS_PER_BYTE", steps), \
                    mock.patch.object(rosbag2, "_STEPS_AT_ONCE", 1000), \
                    self.assertRaisesRegex(ConvertError, "log: its tables list more than a file of this size can hold"):
                convert(path)
            path.unlink()

    def test_messages_compressed_one_by_one_need_their_module(self):
        messages = [(100 + i, compression.ZSTD_MAGIC + made.odometry(i)) for i in range(5)]
        path = made.db3(self.folder / "log", [("/odom", "nav_msgs/msg/Odometry", messages)])
        with mock.patch.object(compression, "_module", lambda *names: None), \
                self.assertRaisesRegex(ConvertError, "compressed one by one: compressed by zstd: install python3-zstandard"):
            convert(path)

        class WithoutMagic:
            class ZstdDecompressor:
                eof = True

                @staticmethod
                def decompress(data, max_length=-1):
                    return data[4:]

        with mock.patch.object(compression, "_module", lambda *names: WithoutMagic):
            self.assert_track(convert(path), range(5), t0=100, metres=1e-9, radians=1e-6)

    def test_a_path_is_its_last_message(self):
        growing = [(100 + n, made.path(range(n + 1))) for n in range(1, 6)]
        topics = [("/path", "nav_msgs/msg/Path", growing), ("/odom", "nav_msgs/msg/Odometry", [(100, made.odometry(0))] * 2)]
        of_ros1 = [(100 + n, made.path(range(n + 1), ros1=True)) for n in range(1, 6)]
        for path in (made.db3(self.folder / "a.db3", topics),
                     self.file(made.mcap([(topic, "cdr", kind, logged) for topic, kind, logged in topics]), "c.mcap"),
                     self.file(made.bag([("/path", "nav_msgs/Path", of_ros1)]), "b.bag")):
            with self.subTest(path.name):
                self.assert_track(convert(path, topic="/path"), range(6), t0=100, metres=1e-9, radians=1e-6)
        self.assertEqual(convert(self.folder / "a.db3").source, "/odom")  # a path is probably a plan
        plan = made.mcap([("/plan", "cdr", "nav_msgs/msg/Path", [(100, made.path(range(4), stamped=False))])])
        with self.assertRaisesRegex(ConvertError, "the poses of /plan have no time stamps, so they are not a track"):
            self.convert(plan)
        cut = made.mcap([("/path", "cdr", "nav_msgs/msg/Path", [(100, made.path(range(4))[:-9])])])
        with self.assertRaisesRegex(ConvertError, "no poses found"):
            self.convert(cut)

    def test_a_log_of_gazebo_is_named(self):
        path = self.folder / "state.tlog"
        with contextlib.closing(sqlite3.connect(path)) as base, base:
            base.execute("CREATE TABLE message_types(id, name)")
            base.execute("CREATE TABLE topics(id, name, message_type_id)")
            base.execute("CREATE TABLE messages(id, time_recv, topic_id, message)")
        with self.assertRaisesRegex(ConvertError, "state.tlog: a log of Gazebo, which is not read; play it .*gazebo_bridge"):
            convert(path)

    def test_another_database_is_refused(self):
        path = self.folder / "log"
        with contextlib.closing(sqlite3.connect(path)) as base, base:
            base.execute("CREATE TABLE notes(a)")
        with self.assertRaisesRegex(ConvertError, "not a recording of ROS 2, or damaged: no such table: topics"):
            convert(path)


if __name__ == "__main__":
    unittest.main()
