"""The ROS 2 bridge with a running sonard, and stand-ins for ROS: frames (a target to port), mounts, clouds, scans, the clock."""
import contextlib
import math
import pathlib
import struct
import subprocess
import tempfile
import threading
import unittest

from common import ROOT, SONARD, config
from ros_stand_ins import PATIENCE_S, Ros, wait_for

from sonard_bridge import conversions as c
from sonard_client import Control, Daemon, OculusClient

SONARCTL = SONARD.parents[1] / "clients/sonarctl"
WAIT = ("--wait", str(PATIENCE_S))  # for the first ping
A, B, C = (4.0, 20.0), (4.0, -10.0), (7.0, 8.0)  # m and degrees, positive to port: spheres of 0.1 m in scenes/l-targets.yaml
RANGE_IMAGES = """
world: {scene: SCENE, seed: 1}
vehicles: [{name: rov, initial_pose: {frame: ENU_FLU, xyz_m: [0, 0, 0]}}]
sonars:
  - {name: front, profile: waterlinked-3d15, bind_ip: ADDRESS, mount: {frame: FLU, xyz_m: [0, 0, 0]},
     options: {acoustics_at_start: enabled, udp_at_start: multicast}}
poses: {protobuf: "ADDRESS:14770", json: "ADDRESS:14771"}
control: {stream: "ADDRESS:14770", http: "ADDRESS:8088"}
""".replace("SCENE", str(ROOT / "scenes/l-targets.yaml"))

LOOKING_DOWN = """
world: {scene: SCENE, seed: 1}
vehicles: [{name: rov, initial_pose: {frame: ENU_FLU, xyz_m: [-7, 0, -3]}}]
sonars: [{name: down, profile: surveyor-240, bind_ip: ADDRESS, mount: {frame: FRD, xyz_m: [0, 0, 0.2], rpy_deg: [0, -90, 0]}}]
poses: {protobuf: "ADDRESS:14770", json: "ADDRESS:14771"}
control: {stream: "ADDRESS:14770", http: "ADDRESS:8088"}
""".replace("SCENE", str(ROOT / "scenes/demo.yaml"))


class WithSonard(unittest.TestCase):
    def start(self, text, *arguments):
        daemon = Daemon(text, SONARD, arguments=arguments)
        self.addCleanup(daemon.__exit__, None, None, None)
        daemon.__enter__()
        return daemon

    def bridge(self, daemon, **parameters):
        ros = Ros(http=f"{daemon.address}:8088", sonard=f"{daemon.address}:14771", **parameters)
        module = ros.module()
        self.addCleanup(module.__exit__, None, None, None)
        ros.node = module.__enter__().Bridge()
        self.addCleanup(ros.node.close)
        return ros

    def drive(self, daemon):
        """A driver that reads pings until the test ends."""
        client = OculusClient(daemon.address)
        client.fire(range_m=10, rate_hz=10)
        def read():
            with contextlib.suppress(OSError):
                for _ in client.pings(timeout=PATIENCE_S):
                    pass
        reader = threading.Thread(target=read, daemon=True)
        reader.start()
        self.addCleanup(client.close)


class ATargetToPort(WithSonard):
    def test_the_static_transform_of_the_image_frame_is_right(self):
        daemon = self.start(config())
        with OculusClient(daemon.address) as sonar:
            sonar.fire(range_m=5, rate_hz=10)
            ping = next(p for p in sonar.pings(timeout=PATIENCE_S) if p.settings.range == 5)
        found = []
        for beam, bearing in enumerate(ping.bearings_rad):  # as on the wire: negative to port
            echo = max(ping.row(row)[beam] for row in range(ping.rows) if 3.5 < ping.ranges_m[row] < 4.5)
            # The direction of a beam as oculus_sonar_driver computes it, and its place in the sonar's frame as RViz computes it.
            x, y, z = c.rotate(c.wxyz(c.IMAGE_IN_FLU_XYZW), (0.0, -math.sin(bearing), math.cos(bearing)))
            found.append((echo, math.degrees(math.atan2(y, x)), z))
        brightest = max(echo for echo, deg, _ in found if deg > 15)
        at_deg = [deg for echo, deg, _ in found if deg > 15 and echo == brightest]  # several: the echo saturates
        self.assertAlmostEqual(sum(at_deg) / len(at_deg), A[1], delta=1)
        self.assertAlmostEqual(max(abs(z) for _, _, z in found), 0, places=9)
        self.assertGreater(brightest, 2 * max(echo for echo, deg, _ in found if deg < -15))  # nothing is there

    def test_scans_hold_the_truth(self):
        daemon = self.start(config())
        ros = self.bridge(daemon, scans=True)
        self.drive(daemon)
        scan = wait_for(lambda: ros.published.get("~/front/scan"))[0]
        self.assertEqual(scan.header.frame_id, "front")
        self.assertGreater(scan.header.stamp.sec, 1_600_000_000)
        self.assertAlmostEqual(scan.angle_min, -scan.angle_max, delta=0.01)
        def at(deg):
            return scan.ranges[round((math.radians(deg) - scan.angle_min) / scan.angle_increment)]
        for range_m, deg in (A, B, C):
            self.assertAlmostEqual(at(deg), range_m - 0.1, delta=0.03)
        for deg in (-20, -5, 27):
            self.assertEqual(at(deg), math.inf)
        self.assertLess(scan.range_min, 1)
        self.assertAlmostEqual(scan.range_max, 10, delta=0.2)

    def test_range_images_have_clouds(self):
        daemon = self.start(RANGE_IMAGES)
        ros = self.bridge(daemon, clouds=True, cloud_threshold=0)
        cloud = wait_for(lambda: [m for m in ros.published.get("~/front/cloud", []) if m.width])[0]
        self.assertEqual((cloud.header.frame_id, cloud.height, cloud.row_step), ("front", 1, len(cloud.data)))
        self.assertEqual([(f.name, f.offset, f.datatype) for f in cloud.fields],
                         [("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 12, 2)])
        points = [struct.unpack_from("<3f", cloud.data, i * cloud.point_step) for i in range(cloud.width)]
        def distance(range_m, deg):
            place = range_m * math.cos(math.radians(deg)), range_m * math.sin(math.radians(deg)), 0
            return min(math.dist(point, place) for point in points)
        for range_m, deg in (A, B, C):
            self.assertLess(distance(range_m, deg), 0.25)
        self.assertGreater(distance(A[0], -A[1]), 0.5)


class ASurveyor(WithSonard):
    def test_the_cloud_agrees_with_the_truth(self):
        daemon = self.start(LOOKING_DOWN)
        ros = self.bridge(daemon, clouds=True, scans=True, tf_static=True)
        host = subprocess.Popen([SONARCTL, "listen", daemon.address, "--make", "surveyor240", *WAIT], stdin=subprocess.DEVNULL,
                                stdout=subprocess.DEVNULL)
        self.addCleanup(host.wait)
        self.addCleanup(host.terminate)
        cloud = wait_for(lambda: [m for m in ros.published.get("~/down/cloud", []) if m.width])[0]
        scan = wait_for(lambda: ros.published.get("~/down/scan"))[0]
        straight_down = scan.ranges[round(-scan.angle_min / scan.angle_increment)]
        self.assertLess(straight_down, math.inf)
        points = [struct.unpack_from("<3f", cloud.data, i * cloud.point_step) for i in range(cloud.width)]
        self.assertLess(min(math.dist(point, (straight_down, 0, 0)) for point in points), 0.3)
        mount = wait_for(lambda: ros.static)[0][0].transform.rotation
        down = c.rotate(c.wxyz((mount.x, mount.y, mount.z, mount.w)), (1, 0, 0))  # x of its fan
        self.assertAlmostEqual(down[2], -1)


class OneBeamAtATime(WithSonard):
    """A scanning sonar and a DVL. Their echoes are a small part of the full scale."""

    def listen(self, daemon, make):
        host = subprocess.Popen([SONARCTL, "listen", daemon.address, "--make", make, *WAIT], stdin=subprocess.DEVNULL,
                                stdout=subprocess.DEVNULL)
        self.addCleanup(host.wait)
        self.addCleanup(host.terminate)

    def test_the_head_of_a_ping360_turns_on_tf(self):
        daemon = self.start(LOOKING_DOWN.replace("surveyor-240", "ping360").replace("rpy_deg: [0, -90, 0]", "rpy_deg: [0, 0, 0]"))
        ros = self.bridge(daemon, clouds=True, cloud_threshold=0.1, tf_static=True)
        self.listen(daemon, "ping360")
        wait_for(lambda: ros.published["/tf"][1:])
        turns = [message.transforms[0].transform.rotation for message in ros.published["/tf"][:2]]
        before, after = (2 * math.atan2(turn.z, turn.w) for turn in turns)
        self.assertLess((after - before + math.pi) % (2 * math.pi) - math.pi, 0)  # to starboard
        self.assertEqual([[t.child_frame_id for t in message] for message in ros.static], [["down"], []])
        cloud = wait_for(lambda: [m for m in ros.published.get("~/down/cloud", []) if m.width])[0]
        points = [struct.unpack_from("<3f", cloud.data, i * cloud.point_step) for i in range(cloud.width)]
        self.assertEqual([(y, z) for _, y, z in points], [(0.0, 0.0)] * len(points))  # in the axes of the head

    def test_the_head_turns_about_the_axis_of_its_mount(self):
        """The mount is upside down, so the head turns to port. With /tf its clouds lie on the wall to port. The wall takes up a
        large part of a turn, because a busy computer leaves out lines."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        scene = pathlib.Path(folder.name) / "wall.yaml"
        scene.write_text("objects: [{name: wall, type: box, material: concrete, size_m: [20, 1, 10], pose: {xyz_m: [0, 3.5, 0]}}]")
        daemon = self.start(LOOKING_DOWN.replace("surveyor-240", "ping360").replace("rpy_deg: [0, -90, 0]", "rpy_deg: [180, 0, 0]")
                            .replace(str(ROOT / "scenes/demo.yaml"), str(scene)).replace("[-7, 0, -3]", "[0, 0, 0]"))
        ros = self.bridge(daemon, clouds=True, cloud_threshold=0.05, tf_static=True)
        self.listen(daemon, "ping360")
        seen, poses = [], {}  # metres ahead and to port, of the points in the lines whose pose has come
        def near_and_far():
            sent, clouds = ros.published.get("/tf", []), ros.published.get("~/down/cloud", [])
            while sent:
                poses.update({(t.header.stamp.sec, t.header.stamp.nanosec): t.transform for t in sent.pop(0).transforms})
            for cloud in [cloud for cloud in list(clouds) if (cloud.header.stamp.sec, cloud.header.stamp.nanosec) in poses]:
                clouds.remove(cloud)
                at = poses[cloud.header.stamp.sec, cloud.header.stamp.nanosec]
                turn = c.wxyz([getattr(at.rotation, axis) for axis in "xyzw"])
                for i in range(cloud.width):
                    x, y, _ = c.rotate(turn, struct.unpack_from("<3f", cloud.data, i * cloud.point_step))
                    seen.append((x + at.translation.x, y + at.translation.y))
            return seen and min(seen)[0] < 1 and max(seen)[0] > 3
        wait_for(near_and_far)
        off = sorted(abs(y - 3) for _, y in seen)
        self.assertLess(off[len(off) // 2], 0.3, off)

    def test_a_dvl_has_a_cloud(self):
        daemon = self.start(LOOKING_DOWN.replace("surveyor-240", "dvl-a50"))
        ros = self.bridge(daemon, clouds=True)
        self.listen(daemon, "dvl")
        cloud = wait_for(lambda: [m for m in ros.published.get("~/down/cloud", []) if m.width])[0]
        for i in range(cloud.width):  # the ground: 1.9 m below, tilted and rippled
            self.assertAlmostEqual(struct.unpack_from("<f", cloud.data, i * cloud.point_step)[0], 1.9, delta=0.4)


class Mounts(WithSonard):
    def test_mounts_follow_the_daemon(self):
        daemon = self.start(config())
        ros = self.bridge(daemon, tf_static=True, base_frame="base_link")
        mount = wait_for(lambda: ros.static)[0][0]
        self.assertEqual((mount.header.frame_id, mount.child_frame_id, mount.transform.rotation.w), ("base_link", "front", 1))
        Control(daemon.address).mount_sonar("front", position=(0.5, 0.2, 0), rpy_deg=(0, 30, 0), frame="FLU")
        mount = wait_for(lambda: ros.static[1:])[0][0]
        self.assertAlmostEqual(mount.transform.translation.y, 0.2)
        ahead = c.rotate(c.wxyz([getattr(mount.transform.rotation, axis) for axis in "xyzw"]), (1, 0, 0))
        self.assertAlmostEqual(ahead[2], -0.5)  # in FLU a positive pitch lowers the bow
        Control(daemon.address).mount_sonar("front", position=(0.5, -0.2, 0))
        moved = wait_for(lambda: ros.static[2:])[0][0]
        self.assertAlmostEqual(moved.transform.translation.y, -0.2)
        self.assertEqual([getattr(moved.transform.rotation, axis) for axis in "xyzw"],
                         [getattr(mount.transform.rotation, axis) for axis in "xyzw"])


class TheClock(WithSonard):
    def test_the_clock_follows_the_steps(self):
        daemon = self.start(config(), "--clock", "lockstep")
        ros = self.bridge(daemon, clock=True, truth_rate_hz=50.0)
        control = Control(daemon.address)
        for dt_s, end_ns in ((0.1, 100_000_000), (0.25, 350_000_000)):
            self.assertEqual(int(control.step(dt_s)["now_ns"]), end_ns)
            wait_for(lambda end_ns=end_ns: ros.node.last_clock_ns == end_ns)
        last = ros.published["/clock"][-1]
        self.assertEqual((last.clock.sec, last.clock.nanosec), (0, 350_000_000))
        wait_for(lambda: any(pose.header.stamp.nanosec == 350_000_000 for pose in ros.published["~/vehicle_pose"]))

    def test_real_time_needs_no_clock(self):
        daemon = self.start(config())
        ros = self.bridge(daemon, clock=True)
        wait_for(lambda: any("sonard's clock is realtime" in text for text in ros.logged))
        self.assertEqual(ros.published["/clock"], [])


class Token(WithSonard):
    def test_the_live_view_accepts_the_token(self):
        with tempfile.TemporaryDirectory() as folder:
            token = pathlib.Path(folder) / "token"
            token.write_text("0123456789abcdef\n", encoding="utf-8")
            token.chmod(0o600)
            daemon = self.start(config(more=f", token_file: {token}"))
            without = self.bridge(daemon, tf_static=True)
            wait_for(lambda: any("token_file" in text for text in without.logged))
            ros = self.bridge(daemon, tf_static=True, truth_rate_hz=20.0, token_file=str(token))
            wait_for(lambda: ros.static and ros.published["~/vehicle_pose"])


if __name__ == "__main__":
    unittest.main()
