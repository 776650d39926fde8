"""Conversion of synthetic MAVLink logs of vehicles: poses are compared with their source."""
import math
import unittest

import made_logs as made
from converted import WithFolder

from sonard_client.convert import ConvertError, Geodetic
from sonard_client.convert.mavlink import crc

HERE = Geodetic(*made.ORIGIN)


class Telemetry(WithFolder):
    def test_attitudes_and_positions_are_paired_by_the_vehicles_clock(self):
        for version in (1, 2):
            for attitude in ("ATTITUDE", "ATTITUDE_QUATERNION"):
                with self.subTest(attitude, version=version):
                    track = self.convert(made.telemetry_log((attitude, "LOCAL_POSITION_NED"), version=version))
                    self.assertEqual((track.source, self.warned), (f"{attitude}+LOCAL_POSITION_NED", []))
                    self.assert_track(track, range(49), t0=25, metres=1e-5, radians=1e-5)
                    self.assertEqual(track.comments[0], "origin: 47.60000000,-122.33000000,10.000")

    def test_time_continues_after_a_restart(self):
        again = made.telemetry_log(began_s=1_700_000_060, boot_s=3)
        rows = self.convert(made.telemetry_log() + again).rows
        self.assertEqual(len(rows), 99)  # one is interpolated between the two parts
        self.assertAlmostEqual(rows[-1].t_s - rows[0].t_s, 64.8, delta=0.02)
        self.assertIn("restarted (1 x)", self.warned[0])

    def test_order_of_preference(self):
        all_of_it = ("ATTITUDE", "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "SIM_STATE", "ODOMETRY")
        log = made.telemetry_log(all_of_it)
        self.assertEqual(self.convert(log).source, "ODOMETRY")
        self.assert_track(self.convert(log), range(50), t0=25, metres=1e-5, radians=1e-5)
        truth = self.convert(log, source="SIM_STATE", origin=HERE)
        self.assert_track(truth, range(50), t0=1_700_000_000, radians=1e-5)  # without a timestamp: time of receipt
        self.assert_track(self.convert(log, source="ATTITUDE+GLOBAL_POSITION_INT", origin=HERE), range(49), t0=25)

    def test_one_of_several_systems_is_used_and_reported(self):
        other = bytearray()
        for step in range(10):
            t, north, east, down, *angles = made.moment(step)
            stamp = round(1e6 * (1_700_000_100 + t)).to_bytes(8, "big")
            other += stamp + made.mavlink_frame("ATTITUDE", (step, *angles, 0, 0, 0), system=2)
            other += stamp + made.mavlink_frame("LOCAL_POSITION_NED", (step, north, east, down, 0, 0, 0), system=2)
        both = made.telemetry_log() + bytes(other)
        self.assertEqual(len(self.convert(both).rows), 49)
        self.assertIn("using 1, which has most", self.warned[0])
        self.assertEqual(len(self.convert(both, system=2).rows), 10)
        with self.assertRaisesRegex(ConvertError, "system 9 is not in the log; systems: 1, 2, 255"):
            self.convert(both, system=9)

    @staticmethod
    def sent_by(component, first, steps, away_m):
        """[(time of receipt, record)] of ODOMETRY and ATTITUDE with LOCAL_POSITION_NED; positions are away_m too deep."""
        out = []
        for step in range(first, first + steps):
            t, north, east, down, *angles = made.moment(step)
            place = north, east, down + away_m
            stamp_us = round(1e6 * (1_700_000_000 + t)) + component  # after those of component 1
            for name, values in (("ODOMETRY", (stamp_us, *place, *made.quaternion(*angles), *[0] * 6, 1, 8, 0, 0, 0)),
                                 ("ATTITUDE", (round(1e3 * t), *angles, 0, 0, 0)),
                                 ("LOCAL_POSITION_NED", (round(1e3 * t), *place, 0, 0, 0))):
                out.append((stamp_us, stamp_us.to_bytes(8, "big") + made.mavlink_frame(name, values, component=component)))
        return out

    def test_one_of_several_components_is_used_and_reported(self):
        both = sorted(self.sent_by(1, 0, 20, 0) + self.sent_by(197, 0, 20, 50), key=lambda record: record[0])
        for source in ("ODOMETRY", "ATTITUDE+LOCAL_POSITION_NED"):
            with self.subTest(source):
                track = self.convert(b"".join(record for _, record in both), source=source)
                self.assert_track(track, range(20), t0=1_700_000_000 if source == "ODOMETRY" else 0, metres=1e-5, radians=1e-5)
                self.assertEqual(len(self.warned), 1)
                for name in ("ATTITUDE", "LOCAL_POSITION_NED", "ODOMETRY"):
                    self.assertIn(f"{name}: component 1 (omitted: 20 messages of 197)", self.warned[0])

    def test_the_autopilot_is_preferred_to_components_that_send_first(self):
        for autopilot, other in ((1, 154), (3, 1)):
            records = sorted(self.sent_by(autopilot, 1, 20, 0) + self.sent_by(other, 0, 20, 50), key=lambda record: record[0])
            beat = bytes(8) + made.mavlink_frame("HEARTBEAT", (0, 12, 3, 0, 0, 3), component=autopilot)
            log = beat + b"".join(record for _, record in records)
            for source in ("ODOMETRY", "ATTITUDE+LOCAL_POSITION_NED"):
                with self.subTest(source, autopilot=autopilot):
                    track = self.convert(log, source=source)
                    self.assertEqual([row.position_m[2] for row in track.rows if row.position_m[2] > 40], [])
                    self.assertEqual(len(track.rows), 20)
                    self.assertIn(f"ODOMETRY: component {autopilot} (omitted: 20 messages of {other})", self.warned[0])

    def test_poses_of_the_autopilot_around_gaps_are_kept(self):
        beat = [(0, bytes(8) + made.mavlink_frame("HEARTBEAT", (0, 12, 3, 0, 0, 3)))]
        sent = self.sent_by
        gap = sent(1, 0, 100, 0) + sent(197, 160, 1, 50) + sent(1, 162, 20, 0)
        for log, steps, omitted in ((beat + gap, [*range(100), *range(162, 182)], 1),
                                    (beat + gap + sent(197, 240, 3, 50) + sent(1, 244, 1, 0),
                                     [*range(100), *range(162, 182), 244], 4),
                                    (sent(197, 0, 10, 50) + sent(1, 70, 10, 0) + beat + sent(1, 80, 5, 0), range(70, 85), 10)):
            for source in ("ODOMETRY", "ATTITUDE+LOCAL_POSITION_NED"):
                t0 = 1_700_000_000 if source == "ODOMETRY" else 0
                with self.subTest(source, omitted=omitted):
                    track = self.convert(b"".join(record for _, record in log), source=source)
                    self.assert_track(track, steps, t0=t0, metres=1e-5, radians=1e-5)
                    for name in source.split("+"):
                        self.assertIn(f"{name}: component 1 (omitted: {omitted} messages of 197)", self.warned[0])
                    self.assertIn("using the autopilot's, else the first, and another one after 5 s of silence", self.warned[0])

    def test_the_origin_is_the_autopilots(self):
        beat = bytes(8) + made.mavlink_frame("HEARTBEAT", (0, 12, 3, 0, 0, 3))
        others = bytes(8) + made.mavlink_frame("GPS_GLOBAL_ORIGIN", (int(1e8), int(2e8), 3000, 0), component=197)
        own = bytes(8) + made.mavlink_frame("GPS_GLOBAL_ORIGIN", (476000000, -1223300000, 10000, 0))
        poses = b"".join(record for _, record in self.sent_by(1, 0, 20, 0))
        for log in (others + beat + own, beat + own + others):
            track = self.convert(log + poses, source="ATTITUDE+LOCAL_POSITION_NED")
            self.assertEqual(track.comments[0], "origin: 47.60000000,-122.33000000,10.000")
            self.assertIn("GPS_GLOBAL_ORIGIN: component 1 (omitted: 1 messages of 197)", self.warned[0])

    def test_only_a_heartbeat_makes_an_autopilot(self):
        records = self.sent_by(197, 0, 100, 0) + self.sent_by(1, 100, 1, 50)
        track = self.convert(b"".join(record for _, record in records), source="ODOMETRY")
        self.assert_track(track, range(100), t0=1_700_000_000, metres=1e-5, radians=1e-5)
        self.assertIn("ODOMETRY: component 197 (omitted: 1 messages of 1)", self.warned[0])

    def test_a_submarines_depth_is_below_its_home(self):
        """A track that begins below the surface must not begin at depth 0."""
        def log(kind):
            out = bytes(8) + made.mavlink_frame("HEARTBEAT", (0, kind, 3, 0, 0, 3))
            for step in range(20):
                t, north, east, down, *angles = made.moment(step)
                lat, lon, alt = made.degrees_at(north, east, down)
                ms, stamp = round(1000 * t), round(1e6 * (1_700_000_000 + t)).to_bytes(8, "big")
                out += stamp + made.mavlink_frame("ATTITUDE", (ms, *angles, 0, 0, 0))
                place = round(1e7 * lat), round(1e7 * lon), round(1e3 * alt), round(-1e3 * down)
                out += stamp + made.mavlink_frame("GLOBAL_POSITION_INT", (ms, *place, 0, 0, 0, 0))
            return out
        track = self.convert(log(12))
        self.assert_track(track, range(20))
        self.assertEqual(track.comments, ["origin: 47.60000000,-122.33000000,10.000 (the first fix, at the surface)"])
        self.assert_track(self.convert(log(11)), range(20), origin_down=2)  # a boat's first fix is at its own height
        other = Geodetic(made.ORIGIN[0], made.ORIGIN[1], 15)
        self.assert_track(self.convert(log(12), origin=other), range(20), origin_down=-5)

    def test_long_times_without_positions_are_reported(self):
        begin = len(made.telemetry_log(("ATTITUDE",), 20))
        log = made.telemetry_log(steps=20) + made.telemetry_log(("ATTITUDE",), 100)[begin:]
        self.assertEqual(len(self.convert(log).rows), 19)
        self.assertEqual(self.warned, ["without a position for 8.1 s at the beginning or the end: omitted"])
        middle = made.telemetry_log(steps=120)[len(made.telemetry_log(steps=100)):]
        self.assertEqual(len(self.convert(log + middle).rows), 119)
        self.assertEqual(self.warned, ["no position for 8.2 s after second 1.8, interpolated linearly"])
        pause = made.telemetry_log(steps=20) + middle  # a pause of all messages is not a missing message
        self.convert(pause)
        self.assertEqual(self.warned, [])

    def test_selected_component(self):
        both = b"".join(record for _, record in
                        sorted(self.sent_by(1, 0, 20, 0) + self.sent_by(197, 0, 20, 50), key=lambda record: record[0]))
        for source in ("ODOMETRY", "ATTITUDE+LOCAL_POSITION_NED"):
            for component, away_m in ((1, 0), (197, 50)):
                track = self.convert(both, source=source, component=component)
                self.assertEqual((len(track.rows), self.warned), (20, []))
                for step, row in enumerate(track.rows):
                    self.assertAlmostEqual(row.position_m[2], made.moment(step)[3] + away_m, places=4)
        with self.assertRaisesRegex(ConvertError, "component 7 sends no poses; components: 1, 197"):
            self.convert(both, component=7)

    def test_another_component_is_used_after_silence(self):
        for gap_steps, used, omitted in ((40, "1", "10 messages of 197"), (52, "1, later 197", "none")):
            with self.subTest(gap_steps):
                records = self.sent_by(1, 0, 10, 0) + self.sent_by(197, 9 + gap_steps, 10, 50)
                track = self.convert(b"".join(record for _, record in records))
                self.assertEqual(len(track.rows), 10 if omitted != "none" else 20)
                self.assertIn(f"ODOMETRY: component {used} (omitted: {omitted})", self.warned[0])

    def test_components_with_different_messages_are_combined(self):
        mixed = [record for _, record in self.sent_by(1, 0, 10, 0)]
        mixed[2::3] = [record for _, record in self.sent_by(197, 0, 10, 0)][2::3]  # positions
        track = self.convert(b"".join(mixed), source="ATTITUDE+LOCAL_POSITION_NED")
        self.assertEqual((len(track.rows), self.warned), (10, []))

    def test_check_value_of_the_crc(self):
        self.assertEqual(crc(b"12345678", ord("9")), 0x6F91)  # check value of CRC-16/MCRF4XX

    def test_motion_capture_and_signed_frames(self):
        t, north, east, down, *angles = made.moment(0)
        for name, values in (("ATT_POS_MOCAP", (0, *made.quaternion(*angles), north, east, down, *[0] * 21)),
                             ("VISION_POSITION_ESTIMATE", (0, north, east, down, *angles, *[0] * 21, 5))):
            with self.subTest(name):
                frame = made.mavlink_frame(name, values, signed=True)
                track = self.convert(round(1e6 * 77).to_bytes(8, "big") + frame, kind="tlog")
                self.assert_track(track, range(1), t0=77, metres=1e-6, radians=1e-6)

    def test_broken_frames_do_not_affect_others(self):
        log = bytearray(made.telemetry_log(("ODOMETRY",)))
        middle = log.index(b"\xfd", len(log) // 2) + 30
        log[middle] ^= 0x10
        track = self.convert(bytes(log))
        self.assertEqual(len(track.rows), 49)
        self.assertRegex(self.warned[0], "bytes outside intact frames were skipped, the first at byte [0-9]+")
        track = self.convert(bytes(log[:-5]))
        self.assertEqual(len(track.rows), 48)
        self.assertIn("ends within a frame", self.warned[0])

    def test_odometry_of_a_body_in_frd_or_flu(self):
        for frames in ((1, 1), (1, 8), (1, 9), (1, 12), (20, 20), (20, 8), (20, 12), (1, 13), (20, 13), (14, 12), (16, 16), (16, 13),
                       (18, 8)):
            with self.subTest(frames):
                turned = (0, 1, 0, 0) if frames[1] == 13 else (1, 0, 0, 0)
                track = self.convert(made.telemetry_log(("ODOMETRY",), frames=frames, turned=turned))
                self.assert_track(track, range(50), t0=25, metres=1e-5, radians=1e-5)
                self.assertEqual(["x is used as north" in text for text in self.warned], [True] * (frames[0] == 20))

    def test_odometry_in_a_world_of_enu_or_flu(self):
        a = math.sqrt(0.5)
        enu, flu = ((0, a, a, 0), lambda n, e, d: (e, n, -d)), ((0, 1, 0, 0), lambda n, e, d: (n, -e, -d))
        for frame, body in ((4, 8), (4, 12), (4, 13), (21, 9), (21, 12), (21, 13), (15, 12), (17, 13), (19, 8)):
            with self.subTest(frame=frame, body=body):
                turn, place = flu if frame == 21 else enu
                log = b""
                for step in range(50):
                    t, north, east, down, *angles = made.moment(step)
                    q = made.times(turn, made.times(made.quaternion(*angles), (0, 1, 0, 0) if body == 13 else (1, 0, 0, 0)))
                    values = round(1e6 * (25 + t)), *place(north, east, down), *q, *[0] * 6, frame, body, 0, 0, 0
                    log += bytes(8) + made.mavlink_frame("ODOMETRY", values)
                self.assert_track(self.convert(log, kind="tlog"), range(50), t0=25, metres=1e-5, radians=1e-5)
                self.assertEqual(["x is used as north" in text for text in self.warned], [True] * (frame == 21))

    def test_a_vehicle_in_enu_that_faces_east_and_climbs(self):
        values = 1000, 3, 0, -2, 1, 0, 0, 0, *[0] * 6, 4, 13, 0, 0, 0  # ROS's axes, no turn: ahead is east; 3 m east, 2 m deep
        row, = self.convert(bytes(8) + made.mavlink_frame("ODOMETRY", values), kind="tlog").rows
        self.assertEqual(row.position_m, (0, 3, 2))
        for got, wanted in zip(row.orientation, made.quaternion(0, 0, math.pi / 2)):
            self.assertAlmostEqual(abs(got), wanted, delta=1e-6)

    def test_a_level_body_in_flu_is_level(self):
        values = 1000, 1, 2, 3, 0, 1, 0, 0, *[0] * 6, 1, 13, 0, 0, 0  # to NED: half a turn about the forward axis
        row, = self.convert(bytes(8) + made.mavlink_frame("ODOMETRY", values)).rows
        self.assertEqual([abs(part) for part in row.orientation], [1, 0, 0, 0])

    def test_odometry_in_unsupported_frames_is_omitted(self):
        names = {0: "GLOBAL", 1: "LOCAL_NED", 4: "LOCAL_ENU", 7: "LOCAL_OFFSET_NED", 12: "BODY_FRD", 14: "MOCAP_NED", 20: "LOCAL_FRD",
                 21: "LOCAL_FLU"}
        for frames in ((21, 21), (4, 4), (4, 20), (1, 20), (20, 1), (1, 0), (12, 12), (7, 12), (14, 1), (99, 12)):
            with self.subTest(frames):
                frame_ids = " and ".join(f"{of} {n}" + (f" ({names[n]})" if n in names else "")
                                         for of, n in zip(("frame_id", "child_frame_id"), frames))
                self.convert(made.telemetry_log(("ODOMETRY",), 3) + made.telemetry_log(("ODOMETRY",), 2, frames=frames))
                self.assertIn(f"ODOMETRY with {frame_ids} (2 messages) was omitted", self.warned[0])
                with self.assertRaises(ConvertError):
                    self.convert(made.telemetry_log(("ODOMETRY",), 2, frames=frames))
                self.assertIn(frame_ids, self.warned[0])


if __name__ == "__main__":
    unittest.main()
