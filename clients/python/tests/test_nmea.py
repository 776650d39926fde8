"""NMEA 0183: sentences and their checksums, signs of angles, what poses are made of, and the command between two sockets."""
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
        """Their checksums were computed by others."""
        self.assertEqual(parse_sentence("$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n").kind, "GGA")
        self.assertEqual(parse_sentence("$PHTRO,0.03,P,0.22,T*56"), Sentence("PHTRO", ("0.03", "P", "0.22", "T")))
        self.assertEqual(parse_sentence("12:00:00.123 $HEHDT,4.55,T*1B").fields, ("4.55", "T"))

    def test_what_is_refused(self):
        for line, why in (("HEHDT,4.55,T*1B", "no \\$"), ("$HEHDT,4.56,T*1B", "checksum '1B' where 18 is right"),
                          ("$HEHDT,4.55,T", "no checksum"), ("$HEHDT,4.55,T*1", "checksum"), ("$HEHDT,4.55,T*xx", "checksum"),
                          ("$HEHDT,4.55,T*1B7", "checksum"), (made.sentence("A,1"), "no kind"), ("", "no \\$")):
            with self.subTest(line), self.assertRaisesRegex(NmeaError, why):
                parse_sentence(line)
        self.assertEqual(parse_sentence("$HEHDT,4.55,T", without_checksum=True).fields[0], "4.55")
        with self.assertRaisesRegex(NmeaError, "checksum"):
            parse_sentence("$HEHDT,4.56,T*1B", without_checksum=True)

    def test_times_of_the_day(self):
        self.assertAlmostEqual(time_of_day_s("235959.50"), 86399.5)
        for bad in ("", "12", "1x0000", "120061.5", "12000a"):
            with self.subTest(bad):
                self.assertIsNone(time_of_day_s(bad))


class Signs(unittest.TestCase):
    def said(self, *bodies):
        instruments = Instruments()
        for body in bodies:
            instruments.feed(parse_sentence(made.sentence(body)))
        return instruments

    def test_bow_up_and_starboard_down_are_positive(self):
        for letters, pitch, roll in (("MT", 2, 3), ("PT", -2, 3), ("MB", 2, -3), ("PB", -2, -3)):
            said = self.said(f"PHTRO,2.00,{letters[0]},3.00,{letters[1]}")
            self.assertEqual((said.pitch_deg, said.roll_deg), (pitch, roll), letters)
        said = self.said("PRDID,-002.00,+003.00,123.40")
        self.assertEqual((said.pitch_deg, said.roll_deg, said.heading_deg), (-2, 3, 123.4))

    def test_a_gyros_heading_goes_before_that_of_prdid(self):
        self.assertEqual(self.said("HEHDT,10.0,T", "PRDID,0,0,50.0").heading_deg, 10)
        self.assertEqual(self.said("PRDID,0,0,50.0", "HEHDT,10.0,T").heading_deg, 10)

    def test_hemispheres(self):
        for halves, latitude, longitude in (("NE", 48.1173, 11.516666667), ("SW", -48.1173, -11.516666667)):
            place = self.said(f"GPGLL,4807.038,{halves[0]},01131.000,{halves[1]},123519,A").place
            self.assertAlmostEqual(place.latitude_deg, latitude)
            self.assertAlmostEqual(place.longitude_deg, longitude)

    def test_what_is_no_fix_is_none(self):
        for body in ("GPGGA,123519,4807.038,N,01131.000,E,0,00,,,M,,M,,", "GPRMC,123519,V,4807.038,N,01131.000,E,,,,,",
                     "GPGLL,4807.038,N,01131.000,E,123519,V", "GPGGA,123519,,,,,1,08,0.9,,M,,M,,", "GPGGA",
                     "GPGLL,4867.0,N,01131.0,E", "GPGLL,9907.038,N,01131.000,E,123519,A",
                     "GPGLL,4807.038,X,01131.000,E,123519,A"):
            with self.subTest(body):
                self.assertIsNone(self.said(body).place)

    def test_one_kind_of_fix_counts(self):
        gga, rmc = "GPGGA,120000,4800.00,N,01100.00,E,1", "GPRMC,120000,A,4900.00,N,01100.00,E"
        self.assertEqual(self.said(gga, rmc).place.latitude_deg, 48)
        self.assertEqual(self.said(rmc, gga).place.latitude_deg, 48)

    def test_empty_fields_leave_what_was(self):
        said = self.said("HEHDT,10.0,T", "HEHDT,,T", "PHTRO,1,M,,T", "SDDPT,,0.5", "PRDID,1,,2")
        self.assertEqual((said.heading_deg, said.pitch_deg, said.water_below_m), (10, None, None))


class Poses(unittest.TestCase):
    def poses(self, *bodies, **assumed):
        poses = NmeaPoses(Assumptions(**assumed))
        for body in bodies:
            poses.feed(parse_sentence(made.sentence(body)))
        return poses

    FIX = "GPGGA,120000,4800.00,N,01100.00,E,1"

    def test_no_pose_before_place_and_heading_are_known(self):
        self.assertIsNone(self.poses(self.FIX).pose())
        self.assertIsNone(self.poses("HEHDT,10.0,T").pose())
        (position, rpy) = self.poses(self.FIX, "HEHDT,90.0,T").pose()
        self.assertEqual((position[2], rpy[:2]), (0.0, (0.0, 0.0)))
        self.assertAlmostEqual(rpy[2], math.pi / 2)
        self.assertEqual(self.poses("HEHDT,10.0,T", north_east_m=(3, 4), depth_m=5).pose()[0], (3, 4, 5))
        self.assertAlmostEqual(self.poses(self.FIX, heading_deg=180).pose()[1][2], math.pi)

    def test_depth_is_what_the_user_says_it_is(self):
        sounding = "SDDPT,7.0,0.0"
        for assumed, depth in (({}, 0), ({"depth_m": 2}, 2), ({"depth_is_vehicle": True}, 7), ({"bottom_m": 30}, 23)):
            with self.subTest(**assumed):
                self.assertEqual(self.poses(self.FIX, "HEHDT,0,T", sounding, **assumed).pose()[0][2], depth)
                self.assertEqual("DPT and DBT are the water below it" in " ".join(self.poses(sounding, **assumed).unknown()),
                                 not (set(assumed) & {"depth_is_vehicle", "bottom_m"}))

    def test_far_fixes_stay_level(self):
        north, east, down = self.poses(self.FIX, "HEHDT,0,T", "GPGGA,120001,4806.00,N,01100.00,E,1").pose()[0]
        self.assertAlmostEqual(north, 11119, delta=10)
        self.assertAlmostEqual(east, 0, delta=1e-3)
        self.assertEqual(down, 0)

    def test_what_nobody_said_is_named(self):
        self.assertEqual(len(self.poses().unknown()), 4)
        self.assertEqual(self.poses(self.FIX, "PRDID,0,0,0", "SDDBT,,f,7.0,M,,F", bottom_m=9).unknown(), [])


class Command(unittest.TestCase):
    def setUp(self):
        self.there = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(self.there.close)
        self.there.bind(("127.0.0.1", 0))
        self.there.settimeout(30)
        self.to = "127.0.0.1:%d" % self.there.getsockname()[1]
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.log = pathlib.Path(folder.name, "nmea.log")

    def said(self, *words):
        error = io.StringIO()
        with contextlib.redirect_stderr(error):
            code = main([*map(str, words), "--to", self.to])
        return code, error.getvalue()

    def test_a_file_becomes_stamped_poses(self):
        self.log.write_text(made.nmea_log(5) + "$GPGGA,broken*00\r\n", encoding="ascii")
        code, text = self.said(self.log, "--fast", "--origin", "47.6,-122.33", "--bottom", 20, "--vehicle", "rov")
        self.assertEqual(code, 0, text)
        self.assertIn("21 lines, 1 refused, 5 poses", text)
        self.assertIn("heard DBT, GGA, HDT, PHTRO\n", text)
        for step in range(5):
            pose = json.loads(self.there.recv(4096))
            t, north, east, down, *angles = made.moment(step)
            self.assertEqual((pose["frame"], pose["vehicle"]), ("NED_FRD", "rov"))
            self.assertAlmostEqual(pose["timestamp"], 43200 + t, places=3)
            for got, wanted in zip(pose["position"] + pose["quaternion"], (north, east, down, *made.quaternion(*angles))):
                self.assertAlmostEqual(got, wanted, delta=0.01)

    def test_a_file_keeps_its_pace(self):
        self.log.write_text(made.nmea_log(6), encoding="ascii")
        began = time.monotonic()
        self.assertEqual(self.said(self.log)[0], 0)
        self.assertGreater(time.monotonic() - began, 0.45)

    def test_by_udp_every_attitude_and_every_fix_is_a_pose(self):
        command = [sys.executable, "-B", "-m", "sonard_client.nmea_to_pose", "--listen", "127.0.0.1:0", "--to", self.to,
                   "--count", "3"]
        process = subprocess.Popen(command, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True,
                                   env=dict(os.environ, PYTHONPATH=str(common.PACKAGE)))
        try:
            self.assertRegex(said := process.stderr.readline(), r"listens on UDP 127\.0\.0\.1:[1-9]")
            instruments_to = "127.0.0.1", int(said.rpartition(":")[2])
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as instruments:
                for datagram in ("HEHDT,10.0,T", Poses.FIX, "HEHDT,20.0,T", "HEHDT,30.0,T"):
                    instruments.sendto(made.sentence(datagram).encode(), instruments_to)
            yaws = []
            for _ in range(3):
                pose = json.loads(self.there.recv(4096))
                self.assertNotIn("timestamp", pose)
                w, z = pose["quaternion"][0], pose["quaternion"][3]
                yaws.append(round(math.degrees(2 * math.atan2(z, w)), 6))
            self.assertEqual(yaws, [10, 20, 30])
            _, text = process.communicate(timeout=30)
            self.assertEqual(process.returncode, 0, text)
            self.assertIn("not told: no pitch and roll", text)
        finally:
            process.kill()
            process.wait()
            process.stderr.close()

    def test_what_goes_wrong_has_its_code(self):
        self.log.write_text(made.nmea_log(3, kinds=("HDT",)), encoding="ascii")
        code, text = self.said(self.log, "--fast")
        self.assertEqual(code, 65)
        self.assertIn("no position", text)
        self.assertEqual(self.said(self.log, "--origin", "north")[0], 64)
        self.assertEqual(self.said(self.log, "--bottom", "3", "--depth-is-vehicle")[0], 64)
        self.assertEqual(self.said(str(self.log) + ".none")[0], 66)
        self.assertEqual(self.said("--listen", "203.0.113.1:9")[0], 69)
        self.assertEqual(self.said("--listen", "127.0.0.1:65536")[0], 64)


if __name__ == "__main__":
    unittest.main()
