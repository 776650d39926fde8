"""Conversion of synthetic logs: places, NMEA, the command; truncated or corrupted logs give poses or one error."""
import contextlib
import io
import math
import random
import re
import unittest

import made_logs as made
from converted import WithFolder

from sonard_client.convert import ConvertError, Geodetic, format_of
from sonard_client.convert.__main__ import main
from sonard_client.geodesy import LocalPlane, ecef, parse_origin
from sonard_client.nmea import Assumptions
from sonard_client.rotations import between, quaternion_from_rpy

HERE = Geodetic(*made.ORIGIN)


class Geodesy(unittest.TestCase):
    def test_known_points_lie_on_the_ellipsoid(self):
        for place, there in (((0, 0, 0), (6378137, 0, 0)), ((0, 90, 10), (0, 6378147, 0)), ((90, 0, 0), (0, 0, 6356752.3142))):
            for got, wanted in zip(ecef(Geodetic(*place)), there):
                self.assertAlmostEqual(got, wanted, delta=1e-4)

    def test_axes_point_north_east_and_down(self):
        plane = LocalPlane(HERE)
        self.assertLess(max(map(abs, plane.ned(HERE))), 1e-6)
        for wanted in ((30, 0, 0), (0, 40, 0), (0, 0, -5), (12, -7, 3)):
            for got, value in zip(plane.ned(Geodetic(*made.degrees_at(*wanted))), wanted):
                self.assertAlmostEqual(got, value, delta=2e-3)

    def test_positions_are_converted_between_origins(self):
        other = LocalPlane(Geodetic(*made.degrees_at(100, 50, -20)))
        for got, value in zip(LocalPlane(HERE).ned_from(other, (1, 2, 3)), (101, 52, -17)):
            self.assertAlmostEqual(got, value, delta=5e-3)

    def test_origins_are_parsed(self):
        self.assertEqual(parse_origin("47.6,-122.33"), Geodetic(47.6, -122.33, 0))
        for bad in ("47.6", "a,b", "91,0,0", "1,2,3,4", "nan,0,0", ""):
            with self.subTest(bad), self.assertRaises(ValueError):
                parse_origin(bad)

    def test_rotations_are_interpolated(self):
        a, b = quaternion_from_rpy(0, 0, 0.2), quaternion_from_rpy(0, 0, 1.0)
        for second in (b, tuple(-v for v in b)):
            for got, wanted in zip(between(a, second, 0.25), quaternion_from_rpy(0, 0, 0.4)):
                self.assertAlmostEqual(got, wanted, places=12)
        self.assertAlmostEqual(between(a, a, 0.5)[0], a[0])


class Nmea(WithFolder):
    def test_every_fix_gives_a_pose(self):
        track = self.convert(made.nmea_log(), origin=HERE, assumed=self.assumed(bottom_m=20))
        self.assertEqual(self.warned, [])
        self.assert_track(track, range(20), t0=43200, radians=1e-6)
        self.assertEqual(self.convert(made.nmea_log()).comments, ["origin: 47.60000000,-122.33000000,0.000 (the first fix)"])
        self.assertIn("DPT and DBT give the water below it", self.warned[0])

    @staticmethod
    def assumed(**what):
        return Assumptions(**what)

    def test_times_continue_past_midnight(self):
        rows = self.convert(made.nmea_log(began_s=86399)).rows
        self.assertAlmostEqual(rows[-1].t_s - rows[0].t_s, 1.9)

    def test_invalid_lines_are_reported_with_their_offset(self):
        log = made.nmea_log().replace("HEHDT,28.6", "HEHDT,29.6", 1)
        log = log[:400] + "noise\r\n" + log[400:]
        self.convert(log, kind="nmea")
        self.assertRegex(self.warned[0], r"at byte 0: checksum is '..', expected ..; lines omitted: [2-4]")
        with self.assertRaisesRegex(ConvertError, "no heading"):
            self.convert(made.nmea_log(kinds=("GGA",)))

    def test_lines_without_a_checksum_are_accepted_on_request(self):
        log = re.sub(r"\*..", "", made.nmea_log())
        with self.assertRaises(ConvertError):
            self.convert(log)
        self.assertEqual(self.warned[0], "at byte 0: checksum is missing (--without-checksum accepts such lines); lines omitted: 80")
        track = self.convert(log, origin=HERE, assumed=self.assumed(bottom_m=20), without_checksum=True)
        self.assertEqual(self.warned, [])
        self.assert_track(track, range(20), t0=43200, radians=1e-6)

    def test_sentences_that_are_not_read_are_named(self):
        self.convert(made.sentence("GPVTG,1,T,,M,2.0,N") + made.nmea_log() + made.sentence("YXXDR,A,1,D,PITCH"))
        self.assertEqual(self.warned[0], "sentences that are not read: VTG, XDR")

    def test_comments_may_have_utf8(self):
        self.assertEqual(format_of(self.file("# Küste\n" + made.nmea_log())), "nmea")
        with self.assertRaisesRegex(ConvertError, "AIS messages, without attitudes"):
            self.convert("!AIVDM,1,1,,A,13HOI:0P0000VOHLCnHQKwvL05Ip,0*23\r\n")


class Corrupted(WithFolder):
    """Any corrupted log gives poses or one error that names the file."""

    LOGS = {"dataflash": made.dataflash_log(("ATT", "POS", "SIM"), 4), "tlog": made.telemetry_log(("ATTITUDE", "ODOMETRY"), 3),
            "mcap": made.mcap([("/odom", "cdr", "nav_msgs/msg/Odometry", [(i, made.odometry(i)) for i in range(4)]),
                               ("/tf", "cdr", "tf2_msgs/msg/TFMessage", [(1, made.transforms(1))])], 2),
            "rosbag": made.bag([("/odom", "nav_msgs/Odometry", [(i, made.odometry(i, ros1=True)) for i in range(3)])]),
            "ulog": made.ulog(True, 3),
            "nmea": made.nmea_log(3, kinds=("HDT", "PRDID", "GGA", "RMC")).encode()}

    def outcome(self, kind, data):
        try:
            self.assertTrue(self.convert(data, kind=kind).rows)
        except ConvertError as error:
            self.assertIn(str(self.folder / "log"), str(error))

    def test_truncated_files_give_their_readable_part(self):
        for kind, log in self.LOGS.items():
            self.assertEqual(format_of(self.file(log)), kind)
            for length in range(0, len(log), 1 + len(log) // 150):
                with self.subTest(kind, length=length):
                    self.outcome(kind, log[:length])

    def test_chunks_within_chunks_are_refused(self):
        nested = b""
        for _ in range(2000):
            size = ("size", len(nested).to_bytes(4, "little"))
            nested = made.bag_record([("op", b"\x05"), ("compression", b"none"), size], nested)
        self.outcome("rosbag", b"#ROSBAG V2.0\n" + nested)

    def test_changed_bytes_cause_no_crash(self):
        draw = random.Random(1)
        for kind, log in self.LOGS.items():
            for number in range(150):
                data = bytearray(log)
                for _ in range(draw.choice((1, 3, 20))):
                    data[draw.randrange(len(data))] = draw.choice((0, 0xFF, draw.randrange(256)))
                with self.subTest(kind, number=number):
                    self.outcome(kind, bytes(data))

    def test_other_files_are_named(self):
        for data, said in ((b"", "is empty"), (b"\x7fELF" + bytes(100), "none of dataflash"),
                           (b"time,x,y\n1,2,3\n", "name the file in `traj"),
                           (b"# frame: ENU_FLU\n1.5 0 0 0 0 0 0 1\n", "sonard plays TUM"), (b"\x1f\x8b\x08", "gunzip -k .*log"),
                           (b"\x28\xb5\x2f\xfd", "zstd -d"), (b"\x04\x22\x4d\x18", "lz4 -d .*log"),
                           (b"#ROSBAG V1.2\n", "rosbag migrate .*log NEW.bag"),
                           (b"FMT, 128, 89, FMT, BBnNZ, Type\n", "as text; give the .bin"), (b"PK\x03\x04..", "unzip"),
                           (b"\xef\xbb\xbf<?xml version='1.0'?><gpx>", "XML, such as GPX"), (b"\n<kml>", "XML.*in metres"),
                           (b"lat,lon,time\n60,5,0\n", "latitudes and longitudes; write poses as CSV, in metres"),
                           (b"t;\"Longitude\";\"Latitude\"\n0;5;60\n", "text with latitudes"), (b'{"type": 1}', "JSON"),
                           (bytes([14, 16]) + bytes(6) + b".FIT" + bytes(20), "FIT"), (b"LASF" + bytes(200), "cloud of points"),
                           (b"\x89HDF\r\n\x1a\n", "BAG, S-102")):
            with self.subTest(data[:8]), self.assertRaisesRegex(ConvertError, said):
                format_of(self.file(data))

    def test_frames_without_times_are_refused(self):
        frames = b"".join(made.mavlink_frame("ATTITUDE", (100 * i, 0, 0, 0, 0, 0, 0)) for i in range(3))
        for name in ("raw.mavlink", "raw.tlog"):
            with self.assertRaisesRegex(ConvertError, "MAVLink frames without times; give the telemetry log"):
                format_of(self.file(frames, name))

    def test_failed_downloads_are_named(self):
        for name, content, says in (("a.tlog", b"version https://git-lfs.github.com/spec/v1\n", "git lfs pull"),
                                    ("a.db3", b"<!DOCTYPE html><html>", "a web page"),
                                    ("a.gpx", b" <html><head>", "a web page"),
                                    ("a.gpx", b"<?xml version=\"1.0\"?><gpx/>", "GPX and KML, without attitudes"),
                                    ("a.pcap", b"\xd4\xc3\xb2\xa1", "a capture of packets"),
                                    ("a.bin.xz", b"\xfd7zXZ\x00", "unxz -k")):
            with self.assertRaisesRegex(ConvertError, says):
                format_of(self.file(content, name))

    def test_a_changed_database_causes_no_crash(self):
        whole = made.db3(self.folder / "whole", made.ROS2_TOPICS).read_bytes()
        draw = random.Random(2)
        for number in range(60):
            data = bytearray(whole)
            for _ in range(draw.choice((1, 20, 300))):
                data[draw.randrange(16, len(data))] = draw.randrange(256)
            with self.subTest(number=number):
                self.outcome("db3", bytes(data[:draw.choice((len(data), draw.randrange(len(data))))]))


class Command(WithFolder):
    def test_a_log_without_positions_gets_a_place(self):
        log = self.file(made.telemetry_without_place(("ATTITUDE", "GLOBAL_POSITION_INT")), "rov.tlog")
        code, text, said = self.run_main(log, "-o", "-", "--at=-1.5,2")
        self.assertEqual(code, 0, said)
        self.assertIn("north and east are held at -1.5, 2", said)
        self.assertEqual(text.splitlines()[-1].split(",")[1:3], ["-1.500000", "2.000000"])

    def test_dead_reckoning_is_done_on_request(self):
        """The vehicle moves along its heading at the given speed."""
        log = self.file(made.telemetry_without_place(("ATTITUDE", "GLOBAL_POSITION_INT")), "rov.tlog")
        code, text, said = self.run_main(log, "-o", "-", "--at=10,20", "--dead-reckon", "0.5")
        self.assertEqual(code, 0, said)
        self.assertIn("dead reckoned at 0.5 m/s ahead: the error grows with time", said)
        rows = [[float(v) for v in line.split(",")] for line in text.splitlines() if line[:1].isdigit()]
        north, east = 10.0, 20.0
        for step, (row, after) in enumerate(zip(rows, rows[1:])):
            self.assertAlmostEqual(row[1], north, delta=1e-4)
            self.assertAlmostEqual(row[2], east, delta=1e-4)
            _, _, _, _, _, pitch, yaw = made.moment(step)
            north += 0.5 * (after[0] - row[0]) * math.cos(pitch) * math.cos(yaw)
            east += 0.5 * (after[0] - row[0]) * math.cos(pitch) * math.sin(yaw)
        self.assertGreater(math.hypot(north - 10, east - 20), 0.3)
        has_positions = self.file(made.dataflash_log(("SIM",), 3))
        for words in ((has_positions, "-o", "-", "--dead-reckon", "1"), (log, "-o", "-", "--dead-reckon", "1000")):
            self.assertEqual(self.run_main(*words)[0], 64)

    def run_main(self, *words):
        out, error = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
            code = main([str(w) for w in words])
        return code, out.getvalue(), error.getvalue()

    def test_the_output_file_is_written(self):
        log, target = self.file(made.dataflash_log(("SIM",), 3), "flight.bin"), self.folder / "way.csv"
        code, _, text = self.run_main(log, "-o", target, "--origin", "47.6,-122.33,10", "--body", "rov")
        self.assertEqual(code, 0, text)
        self.assertIn("flight.bin: 3 poses of SIM over 0.2 s, NED_FRD", text)
        lines = target.read_text(encoding="utf-8").splitlines()
        self.assertEqual(lines[:5], ["# frame: NED_FRD", "# source: SIM", "# origin: 47.60000000,-122.33000000,10.000",
                                     "# t = 0 was 0.000000 s", "t,x,y,z,qw,qx,qy,qz,body"])
        self.assertEqual([line.split(",")[0] for line in lines[5:]], ["0.000000000", "0.100000000", "0.200000000"])
        self.assertTrue(all(line.endswith(",rov") for line in lines[5:]))
        self.assertEqual(list(self.folder.glob("*.part")), [])

    def test_times_are_kept_on_request(self):
        log = self.file(made.telemetry_log(("SIM_STATE",), 3), "flight.tlog")
        code, text, _ = self.run_main(log, "-o", "-", "--keep-time")
        self.assertEqual(code, 0)
        self.assertEqual(text.splitlines()[-3].split(",")[0], "1700000000.000000000")

    def test_the_option_sets_the_frame(self):
        log = self.file(made.mcap([("/odom", "cdr", "nav_msgs/msg/Odometry", [(i, made.odometry(i)) for i in range(3)])]))
        self.assertTrue(self.run_main(log, "-o", "-", "--frame", "NED_FRD")[1].startswith("# frame: NED_FRD"))
        self.assertEqual(self.run_main(self.file(made.dataflash_log()), "-o", "-", "--frame", "ENU_FLU")[0], 64)
        log = self.file(made.mcap([("/pose", "cdr", "geometry_msgs/msg/PoseStamped",
                                    [(i, made.pose_stamped(i, frame="world_ned")) for i in range(3)])]))
        self.assertIn("so the axes are NED_FRD", self.run_main(log, "-o", "-")[2])
        code, text, said = self.run_main(log, "-o", "-", "--frame", "ENU_FLU")
        self.assertEqual((code, text.splitlines()[0], "axes" in said), (0, "# frame: ENU_FLU", False), said)

    def test_options_without_effect_are_refused(self):
        tlog = self.file(made.telemetry_log(("SIM_STATE",), 3), "flight.tlog")
        nmea = self.file(made.nmea_log(), "ship.nmea")
        odom = [(i, made.odometry(i)) for i in range(3)]
        recording = self.file(made.mcap([("/odom", "cdr", "nav_msgs/msg/Odometry", odom)]), "run.mcap")
        for log, *option in ((tlog, "--depth", "3"), (tlog, "--bottom", "20"), (tlog, "--depth-is-vehicle"), (tlog, "--heading", "9"),
                             (tlog, "--without-checksum"), (tlog, "--topic", "/odom"), (nmea, "--source", "SIM"),
                             (nmea, "--system", "1"), (recording, "--component", "1"), (recording, "--depth", "-1")):
            with self.subTest(option):
                code, _, text = self.run_main(log, "-o", "-", *option)
                self.assertEqual(code, 64, text)
                kind = {tlog: "tlog", nmea: "nmea", recording: "mcap"}[log]
                self.assertIn(f"{option[0]} has no effect on {kind}, only on ", text)
        self.assertEqual(self.run_main(nmea, "-o", "-", "--depth", "3", "--heading", "9")[0], 0)

    def test_gaps_are_reported(self):
        late = made.dataflash_message("SIM", 9000000, 0, 0, 0, 0, 476000000, -1223300000, 1, 0, 0, 0)
        log = made.dataflash_log(("SIM",), 3) + late
        self.assertIn("no pose for 8.8 s after second 0.2", self.run_main(self.file(log), "-o", "-")[2])

    def test_exit_codes_are_those_of_the_manual(self):
        log = self.file(made.dataflash_log(("SIM",), 3))
        self.assertEqual(self.run_main(self.folder / "none.bin", "-o", "-")[0], 66)
        code, _, said = self.run_main(log, "-o", self.folder / "no" / "folder.csv")
        self.assertEqual((code, "folder.csv: its folder does not exist" in said), (66, True), said)
        before = log.read_bytes()
        for output, why in ((log, "is the log that is read"), (self.folder, "is a folder")):
            code, _, said = self.run_main(log, "-o", output)
            self.assertEqual((code, why in said), (64, True), said)
        self.assertEqual(log.read_bytes(), before)
        self.assertEqual(self.run_main(log, "-o", "-", "--origin", "x")[0], 64)
        self.assertEqual(self.run_main(log, "-o", "-", "--component", "256")[0], 64)
        for place in ("1", "1,2,3", "a,b", "nan,0", "1,2"):  # the last: the log has positions
            self.assertEqual(self.run_main(log, "-o", "-", "--at", place)[0], 64, place)
        self.assertEqual(self.run_main(log, "-o", "-", "--body", "a b")[0], 64)
        self.assertEqual(self.run_main(self.file(b"\x7fELF"), "-o", "-")[0], 65)


if __name__ == "__main__":
    unittest.main()
