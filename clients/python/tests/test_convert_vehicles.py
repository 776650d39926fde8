"""Conversion of synthetic logs of vehicles, DataFlash and PX4: poses are compared with their source."""
import math
import struct
import unittest
from unittest import mock

import made_logs as made
from converted import WithFolder

from sonard_client.convert import ConvertError, Geodetic

HERE = Geodetic(*made.ORIGIN)


class Dataflash(WithFolder):
    def test_attitude_and_position_are_paired(self):
        track = self.convert(made.dataflash_log(), origin=HERE)
        self.assertEqual((track.frame, track.source, self.warned), ("NED_FRD", "ATT+POS", []))
        self.assert_track(track, range(49))  # no position follows the last attitude

    def test_simulators_truth_is_preferred_and_any_source_selectable(self):
        log = made.dataflash_log(("ATT", "POS", "XKF1", "SIM"))
        self.assertEqual(self.convert(log).source, "SIM")
        self.assert_track(self.convert(log, source="SIM", origin=HERE), range(50))
        core = self.convert(log, source="XKF1")
        self.assert_track(core, range(50))
        self.assertIn("origin: 47.60000000,-122.33000000,10.000", core.comments)
        self.assertAlmostEqual(self.convert(log, source="XKF1:1").rows[0].position_m[2], 102)
        with self.assertRaisesRegex(ConvertError, r"no poses of 'AHR2'; sources: SIM \(50 poses\), XKF1 "):
            self.convert(log, source="AHR2")

    def test_the_core_that_the_autopilot_used_is_preferred(self):
        state = {"XKF4": (20, "QBb", "TimeUS,C,PI", "QBb")}
        with mock.patch.dict(made.DATAFLASH, state):
            log = made.dataflash_log(("XKF1",)) + made.dataflash_format("XKF4")
            first, second = (made.dataflash_message("XKF4", 0, 0, core) for core in (0, 1))
        for states, source, said in ((first, "XKF1", None), (second, "XKF1:1", None),
                                     (first + 3 * second, "XKF1:1", "XKF1:1 (75 %), XKF1 (25 %); using XKF1:1 throughout")):
            with self.subTest(source, said=said):
                track = self.convert(log + states)
                self.assertEqual(track.source, source)
                self.assertAlmostEqual(track.rows[0].position_m[2], 102 if source == "XKF1:1" else 2)
                self.assertEqual(len(self.warned), said is not None)
                self.assertIn(said or "", "".join(self.warned))
        self.assertEqual(self.convert(log + second, source="XKF1").source, "XKF1")
        self.assertIn("XKF1:1 (100 %); using XKF1 throughout", self.warned[0])

    def test_another_origin_shifts_local_positions(self):
        other = Geodetic(*made.degrees_at(-30, 20, 0))
        row = self.convert(made.dataflash_log(("XKF1",)), origin=other).rows[0]
        for got, wanted in zip(row.position_m, (30, -20, 2)):
            self.assertAlmostEqual(got, wanted, delta=0.01)

    def test_default_origin_is_the_first_fix(self):
        track = self.convert(made.dataflash_log())
        self.assertEqual(track.comments, ["origin: 47.60000000,-122.33000000,8.000 (the first fix)"])
        self.assert_track(track, range(49), origin_down=2)

    def test_a_truncated_log_is_read(self):
        log = made.dataflash_log(("SIM",))
        track = self.convert(log[:-20])
        self.assertEqual(len(track.rows), 49)
        self.assertRegex(self.warned[0], rf"ends within a message, at byte {len(log) - 45}")

    def test_garbage_is_skipped(self):
        log, begin = made.dataflash_log(("SIM",)), len(made.dataflash_log(("SIM",), 10))
        track = self.convert(log[:begin] + b"\xa3\x95\xee" + bytes(500) + log[begin:])
        self.assertEqual(len(track.rows), 50)
        self.assertRegex(self.warned[0], f"503 bytes outside messages were skipped, the first at byte {begin}")

    def test_inconsistent_description_is_omitted(self):
        log = made.dataflash_log(("SIM",)).replace(made.dataflash_format("SIM"), made.dataflash_format("SIM", 48))
        with self.assertRaisesRegex(ConvertError, "no poses"):
            self.convert(log)
        self.assertIn("SIM is inconsistent", self.warned[0])

    def test_old_logs_have_milliseconds(self):
        old = {"SIM": (13, "IccCfLL", "TimeMS,Roll,Pitch,Yaw,Alt,Lat,Lng", "IhhHfii")}
        with mock.patch.dict(made.DATAFLASH, old):
            log = made.dataflash_format("SIM") + b"".join(
                made.dataflash_message("SIM", 500 * i, 0, 0, 9000, -3.0, 476000000, -1223300000) for i in range(3))
        track = self.convert(log, origin=Geodetic(47.6, -122.33, 0))
        self.assertEqual([row.t_s for row in track.rows], [0, 0.5, 1])
        self.assertAlmostEqual(track.rows[0].position_m[2], 3, places=5)
        self.assertAlmostEqual(track.rows[0].orientation[3], math.sqrt(0.5), places=6)


class WithoutHorizontalPosition(WithFolder):
    """Logs of a BlueROV2 without DVL: depth and attitude make a track at one place."""

    def assert_held(self, track, steps, at=(0, 0), t0=0.0):
        self.assertEqual(len(track.rows), len(steps))
        for row, step in zip(track.rows, steps):
            t, _, _, down, *angles = made.moment(step)
            self.assertAlmostEqual(row.t_s, t0 + t, delta=0.0051)
            self.assertEqual(row.position_m[:2], at)
            self.assertAlmostEqual(row.position_m[2], down, delta=0.006)
            cosine = abs(sum(a * b for a, b in zip(row.orientation, made.quaternion(*angles))))
            self.assertLess(2 * math.acos(min(1.0, cosine)), 2e-4)
        self.assertEqual(len(self.warned), 1, self.warned)
        self.assertIn(f"no horizontal position (no DVL, UGPS or the like): north and east are held at {at[0]:g}, {at[1]:g}",
                      self.warned[0])
        self.assertIn("--dead-reckon M/S moves the vehicle ahead", self.warned[0])

    def test_telemetry_gives_depths(self):
        for kinds in (("HEARTBEAT", "ATTITUDE", "GLOBAL_POSITION_INT", "VFR_HUD"), ("ATTITUDE", "GLOBAL_POSITION_INT"),
                      ("HEARTBEAT", "ATTITUDE", "VFR_HUD")):
            with self.subTest(kinds):
                track = self.convert(made.telemetry_without_place(kinds))
                self.assertEqual(track.source, "ATTITUDE+depth")
                self.assert_held(track, range(20), t0=25)
                self.assert_held(self.convert(made.telemetry_without_place(kinds), at=(5, -2.5)), range(20), (5, -2.5), t0=25)
        with self.assertRaisesRegex(ConvertError, "lacks positions and depths"):
            self.convert(made.telemetry_without_place(("HEARTBEAT", "ATTITUDE", "VFR_HUD"), submarine=False))  # above the sea
        with self.assertRaisesRegex(ConvertError, "lacks attitudes"):
            self.convert(made.telemetry_without_place(("GLOBAL_POSITION_INT",)))

    def test_a_pressure_sensor_in_the_water_gives_the_depth(self):
        def log(message, hpa_of):
            out = bytearray()
            for step in range(20):
                t, _, _, down, *angles = made.moment(step)
                ms, stamp = round(1000 * t) + 25000, round(1e6 * (1_700_000_000 + t)).to_bytes(8, "big")
                out += stamp + made.mavlink_frame("ATTITUDE", (ms, *angles, 0, 0, 0))
                out += stamp + made.mavlink_frame(message, (ms, hpa_of(down), 0, 2100, 0))
                out += stamp + made.mavlink_frame("SCALED_PRESSURE", (ms, 1008, 0, 3500, 0))  # in the hull
            return bytes(out)
        hpa_per_m = 100.518  # 1025 kg/m3 x 9.80665 m/s2
        track = self.convert(log("SCALED_PRESSURE2", lambda down: 1013.25 + hpa_per_m * down))
        self.assertIn("it is that of SCALED_PRESSURE2 in sea water", self.warned.pop(0))
        self.assert_held(track, range(20), t0=25)
        with self.assertRaisesRegex(ConvertError, "lacks positions and depths"):
            self.convert(log("SCALED_PRESSURE2", lambda down: 1012.0))  # never in the water

    def test_depths_are_kept_before_the_vehicles_clock_is_known(self):
        """VFR_HUD has no time; the time of receipt would be decades after the vehicle's start."""
        first = (1_699_999_999_000_000).to_bytes(8, "big") + made.mavlink_frame("VFR_HUD", (0, 0, -1, 0, 0, 0))
        self.assert_held(self.convert(first + made.telemetry_without_place(("HEARTBEAT", "ATTITUDE", "VFR_HUD"))), range(20), t0=25)

    def test_a_position_is_preferred(self):
        both = made.telemetry_log() + made.telemetry_without_place(("GLOBAL_POSITION_INT", "VFR_HUD"))
        self.assertEqual(self.convert(both).source, "ATTITUDE+LOCAL_POSITION_NED")
        with self.assertRaisesRegex(ValueError, "--at is for logs without horizontal position"):
            self.convert(both, at=(1, 2))

    def test_a_source_with_poses_for_longer_is_named(self):
        """The fix of a vehicle that dives is lost."""
        fix = made.telemetry_log(("ATTITUDE", "GLOBAL_POSITION_INT"), steps=5)
        track = self.convert(fix + made.telemetry_without_place(("ATTITUDE", "GLOBAL_POSITION_INT"), steps=100))
        self.assertEqual(track.source, "ATTITUDE+GLOBAL_POSITION_INT")
        self.assertIn("ATTITUDE+GLOBAL_POSITION_INT gives poses for 0.4 s only, --source ATTITUDE+depth for 9.9 s", self.warned)

    @staticmethod
    def dataflash(name, values):
        log = made.dataflash_format(name) + made.dataflash_format("ATT")
        for step in range(20):
            t, _, _, down, roll, pitch, yaw = made.moment(step)
            angles = [round(100 * math.degrees(angle)) for angle in (roll, pitch, yaw)]
            log += made.dataflash_message("ATT", round(1e6 * t), 0, angles[0], 0, angles[1], 0, angles[2], 0, 0, 3)
            log += b"".join(made.dataflash_message(name, round(1e6 * t), *v) for v in values(down, angles))
        return log

    def test_dataflash_logs_give_depths(self):
        layouts = {"CTUN": (40, "Qff", "TimeUS,ThI,Alt", "Qff"), "BARO": (41, "QBf", "TimeUS,I,Alt", "QBf")}
        cases = {"CTUN": lambda down, _: [(0, -down)],
                 "BARO": lambda down, _: [(0, 99), (1, -down)],
                 "POS": lambda down, _: [(0, 0, 17, -down, 17)]}
        for name, values in cases.items():
            with self.subTest(name), mock.patch.dict(made.DATAFLASH, layouts):
                track = self.convert(self.dataflash(name, values))
                self.assertEqual(track.source, "ATT+depth")
                self.assert_held(track, range(20))

    def test_px4_logs_give_depths(self):
        track = self.convert(made.ulog(has_place=False))
        self.assertEqual(track.source, "vehicle_attitude+depth")
        self.assert_held(track, range(1, 50))  # the first depth is not valid
        self.assert_held(self.convert(made.ulog(has_place=False), at=(3, 4)), range(1, 50), (3, 4))

    def test_a_filter_whose_position_does_not_change_is_reported(self):
        log = self.dataflash("XKF1", lambda down, angles: [(0, *angles, 0, 0, 0, 0, 0.5, 0.25, down, 0, 0, 0, 0)])
        track = self.convert(log)
        self.assertEqual(track.source, "XKF1")
        self.assert_held(track, range(20), (0.5, 0.25))
        self.assert_held(self.convert(log, at=(3, 4)), range(20), (3, 4))

    def test_the_origin_counts_for_a_vehicle_that_stands_still(self):
        log = self.dataflash("XKF1", lambda down, angles: [(0, *angles, 0, 0, 0, 0, 0.5, 0.25, down, 0, 0, 0, 0)])
        with self.assertRaisesRegex(ConvertError, "metres from an unknown origin"):
            self.convert(log, origin=HERE)
        place = round(1e7 * HERE.latitude_deg), round(1e7 * HERE.longitude_deg), round(100 * HERE.altitude_m)
        log += made.dataflash_format("ORGN") + made.dataflash_message("ORGN", 0, 0, *place)
        track = self.convert(log, origin=Geodetic(*made.degrees_at(-30, 20, 0)))
        for got, wanted in zip(track.rows[0].position_m, (30.5, -19.75, made.moment(0)[3])):
            self.assertAlmostEqual(got, wanted, delta=0.01)
        self.assertEqual(len(self.warned), 1)
        self.assertIn("north and east do not change: the vehicle stands still, or", self.warned[0])
        self.assert_held(self.convert(log, at=(3, 4)), range(20), (3, 4))


class Px4(WithFolder):
    def test_estimates_are_read(self):
        track = self.convert(made.ulog())
        self.assertEqual((track.source, track.frame, self.warned), ("vehicle_attitude+vehicle_local_position", "NED_FRD", []))
        self.assert_track(track, range(1, 50), metres=1e-5, radians=1e-5)  # the first position is not valid
        self.assertIn("origin: 47.60000000,-122.33000000,10.000", track.comments)

    def test_the_lowest_instance_with_values_is_used(self):
        track = self.convert(made.ulog(local=1))  # the first of two instances of the attitude is used
        self.assert_track(track, range(1, 50), metres=1e-5, radians=1e-5)
        self.assertIn("origin: 47.60000000,-122.33000000,10.000", track.comments)
        self.assertEqual(self.warned, ["without values of the first instance; used: vehicle_local_position 1"])
        self.convert(made.ulog(has_place=False, local=2))
        self.assertEqual(self.warned[0], "without values of the first instance; used: vehicle_local_position 2")
        second = made.ulog()[len(made.ulog(steps=0)):]  # messages of an instance 0 that come later
        for log in (made.ulog(local=3) + made.ulog_message("A", bytes([0, 1, 0]) + b"vehicle_local_position") + second,):
            self.assertEqual(len(self.convert(log).rows), 49)
            self.assertFalse([text for text in self.warned if "first instance" in text])

    def test_truth_of_the_simulator_is_preferred(self):
        track = self.convert(made.ulog(truth=True))
        self.assertEqual(track.source, "vehicle_attitude_groundtruth+vehicle_local_position_groundtruth")
        self.assertAlmostEqual(track.rows[0].position_m[2], 102)

    def test_positions_that_are_not_valid_are_omitted(self):
        fields = "uint64_t timestamp;double lat;double lon;float alt;bool lat_lon_valid;bool alt_valid"
        log = made.ulog(has_place=False) + made.ulog_message("F", b"vehicle_global_position:" + fields.encode())
        log += made.ulog_message("A", bytes([0]) + struct.pack("<H", 20) + b"vehicle_global_position")
        for step in range(50):
            t, north, east, down, *_ = made.moment(step)
            place = made.degrees_at(north, east, down) if step >= 3 else (47.0, -122.0, 0)
            log += made.ulog_message("D", struct.pack("<HQ2df2?", 20, round(1e6 * t), *place, step not in (0, 2), step > 1))
        track = self.convert(log, source="vehicle_attitude+vehicle_global_position", origin=HERE)
        self.assert_track(track, range(3, 50), radians=1e-5)

    def of_formats(self, *formats, content=b"\x01" * 32):
        log = b"ULog\x01\x12\x35\x01" + bytes(8) + b"".join(made.ulog_message("F", text.encode("latin-1")) for text in formats)
        for number, text in enumerate(formats):
            log += made.ulog_message("A", bytes([0]) + struct.pack("<H", number) + text.partition(":")[0].encode())
            log += made.ulog_message("D", struct.pack("<H", number) + content)
        return log

    def test_formats_of_other_types_are_omitted(self):
        stamp = "uint64_t timestamp;"
        attitude, local, place = "vehicle_attitude", "vehicle_local_position", "vehicle_global_position"
        for name, fields, said in (
                (attitude, "uint64_t[2] timestamp;float[4] q;", r"timestamp is uint64_t\[2\], not uint64_t"),
                (attitude, stamp + "char[4] q;", r"q is char\[4\], not float or double\[4\]"),
                (attitude, stamp + "float[3] q;", r"q is float\[3\], not"),
                (attitude, stamp + "float[\xb2] q;", "'float.*' is not a field of a known type"),
                (attitude, stamp + "float[0] q;", "is not a field of a known type"),
                (attitude, "float[4] q;", "it has no timestamp"),
                (place, stamp + "char lat;char lon;char alt;", "lat is char, not float or double"),
                (local, stamp + "float x;float[3] y;float z;", r"y is float\[3\], not"),
                (local, stamp + "float x;float y;float z;float z;", "z occurs twice"),
                (local, stamp + "float x;float y;float z;float[65535] a;", "longer than a message"),
                (local, stamp + "double ref_lat;char[4] xy_global;", r"xy_global is char\[4\]")):
            with self.subTest(fields), self.assertRaisesRegex(ConvertError, "log: no poses"):
                self.convert(self.of_formats(f"{name}:{fields}"))
            self.assertRegex(self.warned[0], f"^at byte 16: {name} is omitted: its format cannot be read: .*{said}")

    def test_messages_shorter_than_their_format_are_omitted(self):
        with self.assertRaises(ConvertError):
            self.convert(self.of_formats("vehicle_local_position:uint64_t timestamp;uint8_t[60000] a;float x;float y;float z;"))
        self.assertEqual(self.warned[0],
                         "messages of vehicle_local_position omitted because they are shorter than their format: 1")

    def test_a_truncated_file_is_read(self):
        log = made.ulog()
        self.assertEqual(len(self.convert(log[:-10]).rows), 48)
        self.assertRegex(self.warned[0], "ends within a message, at byte [0-9]+")


if __name__ == "__main__":
    unittest.main()
