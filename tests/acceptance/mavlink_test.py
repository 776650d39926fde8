"""An autopilot sends poses over MAVLink while it drives a sonar along a square. The picture must show the point targets at the
positions that follow from the true poses.

The vehicle is mavlink_frames.py, written from the message definitions; pings are read by the Python client, and the moment of
each ping comes from the daemon's events. Only pings whose pose was sent in time are judged; poses that a busy computer sends late
are tested in tests/daemon/emulator/world/world_test.cpp. A stall of the daemon itself is not visible from outside, so some echoes
may be displaced by the motion of the vehicle during the stall. The square is driven again until enough pings can be judged.
"""
import math
import pathlib
import socket
import sys
import tempfile
import threading
import time
import unittest

import mavlink_frames
from running_sonard import ROOT, Sonard, run, SONARD

sys.path.insert(0, str(ROOT / "clients/python"))
from sonard_client import Control, OculusClient  # noqa: E402

SIDE_M, LEG_S, TURN_S, DEPTH_M = 1.0, 1.2, 2.5, 3.0
START_S = 1.0  # time at rest before the motion
SALINITY = 30.0  # that of the water, so that the device assumes the water's sound speed
RANGE_M, FIELD_DEG = 8.0, 50  # targets farther to the side are left out
RING_M, TARGETS = 4.5, 10  # around the middle of the square
OLDEST_POSE_S, UNDER_WAY_S = 0.05, 0.02  # for the pose at a ping: its greatest age, and the least time since it was sent
MOST_STALLED, MOST_STALLED_BUSY = 0.05, 0.5  # fractions of the echoes; the second if the computer delays the vehicle as well
ENOUGH, MOST_LAPS = 30, 10  # pings that suffice, and laps of the square at most
GOLDEN = ROOT / "tests/protocol/mavlink/golden/frames.txt"


def eased(u):
    """Returns a value from 0 to 1, with velocity 0 at both ends, and its derivative."""
    u = min(max(u, 0.0), 1.0)
    return (1 - math.cos(math.pi * u)) / 2, math.pi / 2 * math.sin(math.pi * u)


class Path:
    """The true state of the vehicle: north, east, heading clockwise from north, and the rates of all three."""
    LAP_S = 4 * (LEG_S + TURN_S)

    def __call__(self, t):
        north, east, heading = -SIDE_M / 2, -SIDE_M / 2, 0.0
        t -= START_S
        t = t % self.LAP_S if t > 0 else t
        for _ in range(4):
            share, rate = eased(t / LEG_S)
            ahead = math.cos(heading), math.sin(heading)
            north, east = north + SIDE_M * share * ahead[0], east + SIDE_M * share * ahead[1]
            if t < LEG_S:
                speed = SIDE_M * rate / LEG_S if t > 0 else 0.0
                return north, east, heading, speed * ahead[0], speed * ahead[1], 0.0
            t -= LEG_S
            share, rate = eased(t / TURN_S)
            heading += math.pi / 2 * share
            if t < TURN_S:
                return north, east, heading, 0.0, 0.0, math.pi / 2 * rate / TURN_S
            t -= TURN_S
        return north, east, heading, 0.0, 0.0, 0.0


class Vehicle(threading.Thread):
    """Sends attitudes and, 7 ms later, positions, 50 times a second, along the path; stores the time at which each pose was
    complete."""

    def __init__(self, address, port):
        super().__init__(daemon=True)
        self.to, self.path, self.sent = (address, port), Path(), []
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.settimeout(0)
        self.say = mavlink_frames.Speaker(system=1, component=1)
        self.began_unix, self.began = time.time(), time.monotonic()  # one reading, because the wall clock may be set in the meantime
        self.heard = []
        self.end = threading.Event()

    def now(self):
        return time.monotonic() - self.began

    def send(self, message, **values):
        self.socket.sendto(self.say(message, **values), self.to)

    def run(self):
        beat, waiting = -1, []
        while not self.end.is_set():
            at = round(self.now(), 3)
            _, _, heading, _, _, turn = self.path(at)
            if int(at) > beat:
                beat = int(at)
                self.send("HEARTBEAT", type=12, autopilot=3, base_mode=81, system_status=4, mavlink_version=3)
            self.send("ATTITUDE", time_boot_ms=round(1000 * at) + 5000, yaw=math.remainder(heading, 2 * math.pi), yawspeed=turn)
            self.sent += [(t, self.now()) for t in waiting]
            time.sleep(0.007)
            t = round(self.now(), 3)
            north, east, _, to_north, to_east, _ = self.path(t)
            self.send("LOCAL_POSITION_NED", time_boot_ms=round(1000 * t) + 5000, x=north, y=east, z=DEPTH_M, vx=to_north, vy=to_east)
            waiting = [t] if t - at > 0.018 else []  # wait for the next attitude: this one is too old to be extrapolated
            if not waiting:
                self.sent.append((t, self.now()))
            self.listen()
            time.sleep(0.012)

    def listen(self):
        try:
            while True:
                self.heard += list(mavlink_frames.read_frames(self.socket.recv(2048)))
        except BlockingIOError:
            pass

    def stop(self):
        self.end.set()
        self.join(10)
        self.socket.close()

    def was_in_time(self):
        """Returns whether at most 5 % of the messages, due every 20 ms, were late."""
        late = [one for one, other in zip(self.sent, self.sent[1:]) if other[0] - one[0] > 0.03]
        return len(late) <= 0.05 * len(self.sent)

    def has_fresh_pose_at(self, t):
        return any(stamp >= t - OLDEST_POSE_S for stamp, left in self.sent if left <= t - UNDER_WAY_S)


def target(i):
    """Returns the position of a target: east, north [m]."""
    angle = 2 * math.pi * (i + 0.25) / TARGETS
    return RING_M * math.cos(angle), RING_M * math.sin(angle)


def scene():
    points = "\n".join(f"  - {{name: t{i}, type: point, target_strength_db: -15, pose: {{xyz_m: [{target(i)[0]}, {target(i)[1]}, {-DEPTH_M}]}}}}"
                       for i in range(TARGETS))
    return f"name: ring\nobjects:\n{points}\n"


def expected(ping, pose, place):
    """Returns row and beam, both with fractions, or None if the point is outside the field of view."""
    north, east, heading = pose[:3]
    to_north, to_east = place[1] - north, place[0] - east
    ahead = to_north * math.cos(heading) + to_east * math.sin(heading)
    port = to_north * math.sin(heading) - to_east * math.cos(heading)
    range_m, azimuth = math.hypot(ahead, port), math.atan2(port, ahead)
    if abs(azimuth) > math.radians(FIELD_DEG) or not 1 < range_m < RANGE_M - 0.5:
        return None
    azimuths = [float(a) for a in ping.azimuths_rad]  # falling: beam 0 is most to port
    beam = next(b for b in range(len(azimuths) - 1) if azimuths[b + 1] <= azimuth)
    return range_m / ping.row_m - 0.5, beam + (azimuths[beam] - azimuth) / (azimuths[beam] - azimuths[beam + 1])


def found_near(ping, place):
    """Returns the centre of the echo around the brightest sample near a position."""
    row, beam = (int(round(x)) for x in place)
    rows = range(max(row - 8, 0), min(row + 9, ping.rows))
    beams = range(max(beam - 8, 0), min(beam + 9, ping.beams))
    image = {(r, b): int(ping.samples[r, b]) for r in rows for b in beams}
    top = max(image, key=image.get)
    bright = [(v * v, r, b) for (r, b), v in image.items() if abs(r - top[0]) <= 3 and abs(b - top[1]) <= 4 and v > image[top] / 3]
    weight = sum(w for w, _, _ in bright) or 1  # 1 if nothing is there
    return sum(w * r for w, r, _ in bright) / weight, sum(w * b for w, _, b in bright) / weight, image[top]


class Mavlink(unittest.TestCase):
    def test_the_golden_frames_are_what_the_generator_prints(self):
        self.assertEqual(GOLDEN.read_text(encoding="utf-8").splitlines(), list(mavlink_frames.golden_lines()))

    def test_a_square_under_an_autopilot(self):
        with tempfile.TemporaryDirectory() as folder:
            ring = pathlib.Path(folder) / "ring.yaml"
            ring.write_text(scene(), encoding="utf-8")
            # The engine omits motion during a ping, so that one pose determines all positions.
            with Sonard(scene=ring, pose=f"{{frame: ENU_FLU, xyz_m: [0, 0, {-DEPTH_M}]}}",
                        more="engine: {noise: off, motion: off}", poses=", mavlink: 'udpin:ADDRESS:14551'") as daemon:
                vehicle, pings, fired_at = self.drive(daemon)
            self.judge(vehicle, pings, fired_at)

    def drive(self, daemon):
        fired_at, pings = {}, []
        control = Control(daemon.address)
        events = control.events(pings=True, timeout=60)
        listener = threading.Thread(target=self.collect, args=(events, fired_at), daemon=True)
        listener.start()
        vehicle = Vehicle(daemon.address, 14551)
        vehicle.start()
        try:
            with OculusClient(daemon.address) as sonar:
                sonar.fire(range_m=RANGE_M, rate_hz=10, gain_percent=20, mode=1, beams=256, bits=16, gamma=255, salinity=SALINITY)
                for lap in range(1, MOST_LAPS + 1):
                    while vehicle.now() < START_S + lap * Path.LAP_S:
                        pings.append(sonar.ping(timeout=60))
                    if len(self.judged(vehicle, pings, fired_at)) >= ENOUGH:
                        break
            status = control.status()["vehicles"][0]
        finally:
            vehicle.stop()
            events.interrupt()
            listener.join(60)
            events.close()
        self.assertIn("system 1 LOCAL_POSITION_NED and attitude", status["source"])
        self.assertIn("system 1 (ArduPilot) sends HEARTBEAT, ATTITUDE, LOCAL_POSITION_NED; poses from LOCAL_POSITION_NED and attitude",
                      daemon.log())
        names = [name for name, _ in vehicle.heard]
        self.assertGreaterEqual(names.count("HEARTBEAT"), 3)
        self.assertEqual(set(names), {"HEARTBEAT"}, "sonard requests nothing from an autopilot unless the configuration says so")
        self.assertTrue(all(v["autopilot"] == 8 and v["type"] == 18 and v["system"] == 1 for _, v in vehicle.heard))
        return vehicle, pings, fired_at

    @staticmethod
    def collect(events, fired_at):
        for event in events:
            if "ping" in event:
                fired_at[event["ping"]["number"]] = event["ping"]["fired_at_ns"]

    @staticmethod
    def judged(vehicle, pings, fired_at):
        """Returns (ping, time) of the pings whose pose was sent in time."""
        timed = [(ping, fired_at[ping.number] / 1e9 - vehicle.began_unix) for ping in pings if ping.number in fired_at]
        return [(ping, t) for ping, t in timed if t >= START_S / 2 and vehicle.has_fresh_pose_at(t)]

    def judge(self, vehicle, pings, fired_at):
        judged, seen, stalled, headings = self.judged(vehicle, pings, fired_at), [], [], set()
        for ping, t in judged:
            pose = vehicle.path(t)
            off_deg = math.degrees(math.remainder(math.radians(ping.heading_deg) - pose[2], 2 * math.pi))
            headings.add(round(pose[2] / (math.pi / 2)) % 4)
            for i in range(TARGETS):
                place = expected(ping, pose, target(i))
                if place is None:
                    continue
                row, beam, value = found_near(ping, place)
                where = f"target {i} at {t:.3f} s: row {row:.2f}, beam {beam:.2f}; by the true pose {place[0]:.2f}, {place[1]:.2f}"
                seen.append((abs(row - place[0]), abs(beam - place[1])))
                if value == 0 or seen[-1][0] > 1.0 or seen[-1][1] > 0.5 or abs(off_deg) > 0.3:
                    stalled.append(where)
        self.assertGreaterEqual(len(seen), 40)
        print(f"{len(judged)} of {len(pings)} pings, {len(seen)} echoes: rows off by {max(r for r, _ in seen):.2f} at most, "
              f"beams by {max(b for _, b in seen):.2f}; {len(stalled)} beyond one row and half a beam")
        most = MOST_STALLED if vehicle.was_in_time() else MOST_STALLED_BUSY
        self.assertLessEqual(len(stalled), most * len(seen), stalled)
        self.assertGreaterEqual(len(judged), 20)
        self.assertEqual(headings, {0, 1, 2, 3}, "pings came from every side of the square")

    def test_a_listener_for_other_computers_needs_allow_from(self):
        with tempfile.TemporaryDirectory() as folder:
            config = pathlib.Path(folder) / "sonard.yaml"
            config.write_text("world: {scene: demo.yaml}\nvehicles: [{name: rov}]\n"
                              "sonars: [{name: front, profile: oculus-m1200d, bind_ip: 127.0.0.2}]\n"
                              "poses: {mavlink: 'udpin:0.0.0.0:14551'}\n", encoding="utf-8")
            result = run(SONARD, "check", config)
            self.assertEqual(result.returncode, 78)
            self.assertIn("poses.mavlink: poses from other computers need poses.allow_from", result.stdout + result.stderr)


if __name__ == "__main__":
    unittest.main()
