"""NMEA 0183: sentences, checksums, signs of angles, poses, and the command between two sockets."""
import contextlib
import io
import json
import math
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import time
import unittest

import common
import made_logs as made

from sonard_client.nmea import Assumptions, Instruments, NmeaError, NmeaPoses, Sentence, parse_sentence, time_of_day_s
from sonard_client.nmea_to_pose import main


class Sentences(unittest.TestCase):
    def test_known_sentences(self):
        """The checksums come from other sources."""
        self.assertEqual(parse_sentence("$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n").kind, "GGA")
        self.assertEqual(parse_sentence("$PHTRO,0.03,P,0.22,T*56"), Sentence("PHTRO", ("0.03", "P", "0.22", "T")))
        self.assertEqual(parse_sentence("12:00:00.123 $HEHDT,4.55,T*1B").fields, ("4.55", "T"))

    def test_invalid_sentences_are_refused(self):
        for line, why in (("HEHDT,4.55,T*1B", "\\$ is missing"), ("$HEHDT,4.56,T*1B", "checksum is '1B', expected 18"),
                          ("$HEHDT,4.55,T", "checksum is missing"), ("$HEHDT,4.55,T*1", "checksum"),
                          ("$HEHDT,4.55,T*xx", "checksum"), ("$HEHDT,4.55,T*1B7", "checksum"),
                          (made.sentence("A,1"), "not a sentence type"), ("", "\\$ is missing")):
            with self.subTest(line), self.assertRaisesRegex(NmeaError, why):
                parse_sentence(line)
        self.assertEqual(parse_sentence("$HEHDT,4.55,T", without_checksum=True).fields[0], "4.55")
        with self.assertRaisesRegex(NmeaError, "checksum"):
            parse_sentence("$HEHDT,4.56,T*1B", without_checksum=True)

    def test_times_of_the_day_are_read(self):
        self.assertAlmostEqual(time_of_day_s("235959.50"), 86399.5)
        for bad in ("", "12", "1x0000", "120061.5", "12000a"):
            with self.subTest(bad):
                self.assertIsNone(time_of_day_s(bad))


class Signs(unittest.TestCase):
    def after(self, *bodies):
        instruments = Instruments()
        for body in bodies:
            instruments.feed(parse_sentence(made.sentence(body)))
        return instruments

    def test_bow_up_and_starboard_down_are_positive(self):
        for letters, pitch, roll in (("MT", 2, 3), ("PT", -2, 3), ("MB", 2, -3), ("PB", -2, -3)):
            now = self.after(f"PHTRO,2.00,{letters[0]},3.00,{letters[1]}")
            self.assertEqual((now.pitch_deg, now.roll_deg), (pitch, roll), letters)
        now = self.after("PRDID,-002.00,+003.00,123.40")
        self.assertEqual((now.pitch_deg, now.roll_deg, now.heading_deg), (-2, 3, 123.4))
        now = self.after("PASHR,123519.00,123.40,T,+03.00,-02.00,+0.10,0.02,0.02,0.05,2,1")
        self.assertEqual((now.pitch_deg, now.roll_deg, now.heading_deg), (-2, 3, 123.4))
        now = self.after("PASHR,123519.00,,T,+03.00,-02.00,+0.10", "HCHDG,98.3,0.0,E,12.6,W")
        self.assertEqual((now.pitch_deg, now.roll_deg), (-2, 3))
        self.assertAlmostEqual(now.heading_deg, 85.7)  # PASHR had no heading
        for other in ("PASHR,123519.00,123.40,T,,-02.00", "PASHR,POS,0,08,123519", "PASHR,1,2"):
            self.assertEqual((self.after(other).pitch_deg, self.after(other).received), (None, set()), other)

    def test_other_sentences_are_ignored(self):
        now = self.after("YXXDR,A,1.5,D,PITCH", "HEHDT,10.0,T", "PIXSE,ATITUD,-1.6,-0.4", "YXXDR,A,1.5,D,PITCH")
        self.assertEqual(now.unread, {"XDR", "PIXSE"})

    def test_hdt_is_preferred_to_prdid(self):
        self.assertEqual(self.after("HEHDT,10.0,T", "PRDID,0,0,50.0").heading_deg, 10)
        self.assertEqual(self.after("PRDID,0,0,50.0", "HEHDT,10.0,T").heading_deg, 10)
        self.assertEqual(self.after("HEHDT,10.0,T", "PASHR,1,50.0,T,0,0").heading_deg, 10)

    def test_other_headings_are_read(self):
        self.assertEqual(self.after("GPTHS,77.5,A").heading_deg, 77.5)
        self.assertIsNone(self.after("GPTHS,77.5,V").heading_deg)
        for fields, heading in (("98.3,1.0,E,12.6,W", 86.7), ("98.3,,,12.6,E", 110.9), ("5.0,1.0,W,10.0,W", 354), ("98.3,,,,", None),
                                ("98.3", None), (",,,12.6,E", None)):
            with self.subTest(fields):
                got = self.after("HCHDG," + fields).heading_deg
                self.assertIsNone(got) if heading is None else self.assertAlmostEqual(got, heading)
        for better in ("HEHDT,10.0,T", "HETHS,10.0,A", "PRDID,0,0,10.0"):
            for bodies in ((better, "HCHDG,98.3,,,1.0,E"), ("HCHDG,98.3,,,1.0,E", better)):
                self.assertEqual(self.after(*bodies).heading_deg, 10, bodies)

    def test_hemispheres_have_their_sign(self):
        for halves, latitude, longitude in (("NE", 48.1173, 11.516666667), ("SW", -48.1173, -11.516666667)):
            place = self.after(f"GPGLL,4807.038,{halves[0]},01131.000,{halves[1]},123519,A").place
            self.assertAlmostEqual(place.latitude_deg, latitude)
            self.assertAlmostEqual(place.longitude_deg, longitude)

    def test_sentences_without_a_fix_are_ignored(self):
        for body in ("GPGGA,123519,4807.038,N,01131.000,E,0,00,,,M,,M,,", "GPRMC,123519,V,4807.038,N,01131.000,E,,,,,",
                     "GPGLL,4807.038,N,01131.000,E,123519,V", "GPGGA,123519,,,,,1,08,0.9,,M,,M,,", "GPGGA",
                     "GPGLL,4867.0,N,01131.0,E", "GPGLL,9907.038,N,01131.000,E,123519,A",
                     "GPGLL,4807.038,X,01131.000,E,123519,A"):
            with self.subTest(body):
                self.assertIsNone(self.after(body).place)

    def test_gga_is_preferred(self):
        gga, rmc = "GPGGA,120000,4800.00,N,01100.00,E,1", "GPRMC,120000,A,4900.00,N,01100.00,E"
        self.assertEqual(self.after(gga, rmc).place.latitude_deg, 48)
        self.assertEqual(self.after(rmc, gga).place.latitude_deg, 48)

    def test_empty_fields_keep_the_previous_values(self):
        now = self.after("HEHDT,10.0,T", "HEHDT,,T", "PHTRO,1,M,,T", "SDDPT,,0.5", "PRDID,1,,2")
        self.assertEqual((now.heading_deg, now.pitch_deg, now.water_below_m), (10, None, None))


class Poses(unittest.TestCase):
    def poses(self, *bodies, **assumed):
        poses = NmeaPoses(Assumptions(**assumed))
        for body in bodies:
            poses.feed(parse_sentence(made.sentence(body)))
        return poses

    FIX = "GPGGA,120000,4800.00,N,01100.00,E,1"

    def test_no_pose_before_position_and_heading_are_known(self):
        self.assertIsNone(self.poses(self.FIX).pose())
        self.assertIsNone(self.poses("HEHDT,10.0,T").pose())
        (position, rpy) = self.poses(self.FIX, "HEHDT,90.0,T").pose()
        self.assertEqual((position[2], rpy[:2]), (0.0, (0.0, 0.0)))
        self.assertAlmostEqual(rpy[2], math.pi / 2)
        self.assertEqual(self.poses("HEHDT,10.0,T", north_east_m=(3, 4), depth_m=5).pose()[0], (3, 4, 5))
        self.assertAlmostEqual(self.poses(self.FIX, heading_deg=180).pose()[1][2], math.pi)

    def test_meaning_of_the_depth_is_configurable(self):
        sounding = "SDDPT,7.0,0.0"
        for assumed, depth in (({}, 0), ({"depth_m": 2}, 2), ({"depth_is_vehicle": True}, 7), ({"bottom_m": 30}, 23)):
            with self.subTest(**assumed):
                self.assertEqual(self.poses(self.FIX, "HEHDT,0,T", sounding, **assumed).pose()[0][2], depth)
                self.assertEqual("DPT and DBT give the water below it" in " ".join(self.poses(sounding, **assumed).unknown()),
                                 not (set(assumed) & {"depth_is_vehicle", "bottom_m"}))

    def test_distant_fixes_keep_depth_zero(self):
        north, east, down = self.poses(self.FIX, "HEHDT,0,T", "GPGGA,120001,4806.00,N,01100.00,E,1").pose()[0]
        self.assertAlmostEqual(north, 11119, delta=10)
        self.assertAlmostEqual(east, 0, delta=1e-3)
        self.assertEqual(down, 0)

    def test_unknown_values_are_listed(self):
        self.assertEqual(len(self.poses().unknown()), 4)
        self.assertEqual(self.poses(self.FIX, "PRDID,0,0,0", "SDDBT,,f,7.0,M,,F", bottom_m=9).unknown(), [])


class Command(unittest.TestCase):
    def setUp(self):
        self.receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(self.receiver.close)
        self.receiver.bind(("127.0.0.1", 0))
        self.receiver.settimeout(30)
        self.to = "127.0.0.1:%d" % self.receiver.getsockname()[1]
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.log = pathlib.Path(folder.name, "nmea.log")

    def run_main(self, *words):
        error = io.StringIO()
        with contextlib.redirect_stderr(error):
            code = main([*map(str, words), "--to", self.to])
        return code, error.getvalue()

    def test_a_file_becomes_stamped_poses(self):
        self.log.write_text(made.nmea_log(5) + "$GPGGA,broken*00\r\n", encoding="ascii")
        code, text = self.run_main(self.log, "--fast", "--origin", "47.6,-122.33", "--bottom", 20, "--vehicle", "rov")
        self.assertEqual(code, 0, text)
        self.assertIn("21 lines, 1 invalid, 5 poses", text)
        self.assertIn("received DBT, GGA, HDT, PHTRO\n", text)
        for step in range(5):
            pose = json.loads(self.receiver.recv(4096))
            t, north, east, down, *angles = made.moment(step)
            self.assertEqual((pose["frame"], pose["vehicle"]), ("NED_FRD", "rov"))
            self.assertAlmostEqual(pose["timestamp"], 43200 + t, places=3)
            for got, wanted in zip(pose["position"] + pose["quaternion"], (north, east, down, *made.quaternion(*angles))):
                self.assertAlmostEqual(got, wanted, delta=0.01)

    def test_a_file_keeps_its_pace(self):
        self.log.write_text(made.nmea_log(6), encoding="ascii")
        began = time.monotonic()
        self.assertEqual(self.run_main(self.log)[0], 0)
        self.assertGreater(time.monotonic() - began, 0.45)

    def test_each_attitude_and_fix_by_udp_gives_a_pose(self):
        command = [sys.executable, "-B", "-m", "sonard_client.nmea_to_pose", "--listen", "127.0.0.1:0", "--to", self.to,
                   "--count", "3"]
        process = subprocess.Popen(command, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True,
                                   env=dict(os.environ, PYTHONPATH=str(common.PACKAGE)))
        try:
            self.assertRegex(line := process.stderr.readline(), r"listening on UDP 127\.0\.0\.1:[1-9]")
            instruments_to = "127.0.0.1", int(line.rpartition(":")[2])
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as instruments:
                for datagram in ("HEHDT,10.0,T", Poses.FIX, "HEHDT,20.0,T", "HEHDT,30.0,T"):
                    instruments.sendto(made.sentence(datagram).encode(), instruments_to)
            yaws = []
            for _ in range(3):
                pose = json.loads(self.receiver.recv(4096))
                self.assertNotIn("timestamp", pose)
                w, z = pose["quaternion"][0], pose["quaternion"][3]
                yaws.append(round(math.degrees(2 * math.atan2(z, w)), 6))
            self.assertEqual(yaws, [10, 20, 30])
            _, text = process.communicate(timeout=30)
            self.assertEqual(process.returncode, 0, text)
            self.assertIn("missing: no pitch and roll", text)
        finally:
            process.kill()
            process.wait()
            process.stderr.close()

    def test_exit_codes_are_those_of_the_manual(self):
        self.log.write_text(made.nmea_log(3, kinds=("HDT",)), encoding="ascii")
        code, text = self.run_main(self.log, "--fast")
        self.assertEqual(code, 65)
        self.assertIn("no position", text)
        self.assertEqual(self.run_main(self.log, "--origin", "north")[0], 64)
        self.assertEqual(self.run_main(self.log, "--bottom", "3", "--depth-is-vehicle")[0], 64)
        self.assertEqual(self.run_main(str(self.log) + ".none")[0], 66)
        self.assertEqual(self.run_main("--listen", "203.0.113.1:9")[0], 69)
        code, text = self.run_main("--listen", "127.0.0.1:65536")
        self.assertEqual((code, text.count("\n")), (64, 1), text)


if __name__ == "__main__":
    unittest.main()
