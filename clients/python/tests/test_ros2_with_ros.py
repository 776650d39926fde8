"""The ROS 2 bridge as a process with a real rclpy, where that is installed: poses, mounts, the end, and the launch files."""
import importlib.util
import json
import math
import os
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

from common import SONARD, config
from ros_stand_ins import BRIDGE

from sonard_bridge.conversions import rotate, wxyz
from sonard_client import Control, Daemon

PATIENCE_S = 300
HAS_ROS = importlib.util.find_spec("rclpy") is not None
if not HAS_ROS:
    print("rclpy is not installed: the ROS 2 bridge is tested with stand-ins for ROS alone", file=sys.stderr)
ENVIRONMENT = {**os.environ, "PYTHONPATH": f"{BRIDGE}:{os.environ.get('PYTHONPATH', '')}"}
ARGUMENTS = ("import sys, launch.launch_description_sources as sources\n"
             "description = sources.get_launch_description_from_python_launch_file(sys.argv[1])\n"
             "print([argument.name for argument in description.get_launch_arguments()])")
MAIN = "import sys; from sonard_bridge.node import main; sys.exit(main())"


@unittest.skipUnless(HAS_ROS, "rclpy is not installed")
class WithRos(unittest.TestCase):
    def start(self, *parameters):
        log = tempfile.TemporaryFile()
        self.addCleanup(log.close)
        given = [word for parameter in parameters for word in ("-p", parameter)]
        process = subprocess.Popen([sys.executable, "-B", "-c", MAIN, "--ros-args", *given], env=ENVIRONMENT, stdout=log, stderr=log)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)

        def said():
            log.seek(0)
            return log.read().decode()
        return process, said

    def setUp(self):
        import rclpy
        rclpy.init()
        self.addCleanup(rclpy.try_shutdown)
        self.rclpy, self.node = rclpy, rclpy.create_node("test")
        self.addCleanup(self.node.destroy_node)

    def spin_until(self, found):
        for _ in range(20 * PATIENCE_S):
            if result := found():
                return result
            self.rclpy.spin_once(self.node, timeout_sec=0.05)
        raise AssertionError("did not come")

    def test_odometry_reaches_sonard_and_signals_end_the_node(self):
        from nav_msgs.msg import Odometry
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as there:
            there.bind(("127.0.0.1", 0))
            there.setblocking(False)
            for end in (signal.SIGTERM, signal.SIGINT):
                name = str(int(end))  # lines of the previous process may still wait
                process, said = self.start("odometry:=/odom", "sonard:=127.0.0.1:%d" % there.getsockname()[1],
                                           f"vehicle:={name}", "tf_rate_hz:=50")
                publisher = self.node.create_publisher(Odometry, "/odom", 10)
                message = Odometry()
                message.header.stamp.sec = 3
                message.pose.pose.position.x, message.pose.pose.orientation.w = 1.5, 1.0

                def arrived():
                    publisher.publish(message)
                    try:
                        line = json.loads(there.recv(4096))
                    except BlockingIOError:
                        return None
                    return line if line["vehicle"] == name else None
                line = self.spin_until(arrived)
                self.assertEqual((line["position"], line["timestamp"]), ([1.5, 0, 0], 3))
                process.send_signal(end)
                self.assertEqual(process.wait(PATIENCE_S), 0, said())
                self.assertNotIn("Traceback", said())
                self.assertNotIn("rosout", said())

    def test_a_signal_at_any_moment_ends_the_node(self):
        for wait_s in (0.0, 0.001, 0.003, 0.01, 0.03, 0.1):  # time since its first line, while the executor is created and waits
            process, said = self.start("odometry:=/odom")
            self.spin_until(lambda said=said: "poses from" in said())
            time.sleep(wait_s)
            process.send_signal(signal.SIGTERM)
            self.assertEqual(process.wait(PATIENCE_S), 0, said())
            self.assertNotIn("Traceback", said())

    def test_wrong_parameters_are_one_sentence(self):
        for parameters, name in (((), "odometry"), (("odometry:=/odom", "tf_rate_hz:=0.0"), "tf_rate_hz"),
                                 (("odometry:=/odom", "vehicle:=true"), "vehicle")):
            process, said = self.start(*parameters)
            self.assertEqual(process.wait(PATIENCE_S), 2, said())
            self.assertIn(f"sonard_bridge: parameter {name}: ", said())
            self.assertNotIn("Traceback", said())

    def test_topics_of_sonard_are_published(self):
        from geometry_msgs.msg import PoseStamped
        from rclpy.qos import DurabilityPolicy, QoSProfile
        from rosgraph_msgs.msg import Clock
        from tf2_msgs.msg import TFMessage
        with Daemon(config(), str(SONARD), arguments=("--clock", "lockstep")) as daemon:
            process, said = self.start("truth_rate_hz:=20", "tf_static:=true", "clock:=true", f"http:={daemon.address}:8088",
                                       f"sonard:={daemon.address}:14771")
            found = {}
            self.node.create_subscription(PoseStamped, "/sonard_bridge/vehicle_pose", lambda m: found.update(pose=m), 10)
            self.node.create_subscription(Clock, "/clock", lambda m: found.update(clock=m), 10)
            self.spin_until(lambda: "pose" in found)
            Control(daemon.address).step(0.25)
            self.spin_until(lambda: found.get("clock") and found["clock"].clock.nanosec == 250_000_000)
            late = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)  # it was sent long ago
            self.node.create_subscription(TFMessage, "/tf_static", lambda m: found.update(mounts=m), late)
            mounts = self.spin_until(lambda: found.get("mounts"))
            self.assertEqual([(t.header.frame_id, t.child_frame_id) for t in mounts.transforms], [("rov", "front")])
            self.assertIsNone(process.poll(), said())

    def test_clouds_of_a_head_that_turns_lie_where_tf_puts_them(self):
        """The mount is upside down, so the head turns to port, where the target is."""
        from sensor_msgs.msg import PointCloud2
        from tf2_ros import Buffer, TransformException, TransformListener
        head = config().replace("oculus-m1200d", "ping360").replace(", status_to: [ADDRESS]", "").replace(
            "{frame: FLU, xyz_m: [0, 0, 0]}}]", "{frame: FRD, xyz_m: [0, 0, 0.2], rpy_deg: [180, 0, 0]}}]")
        with Daemon(head, str(SONARD)) as daemon:
            self.start("clouds:=true", "cloud_threshold:=0.05", "tf_static:=true", f"http:={daemon.address}:8088")
            buffer = Buffer()
            TransformListener(buffer, self.node)
            clouds, points = [], []
            self.node.create_subscription(PointCloud2, "/sonard_bridge/front/cloud", clouds.append, 10)
            host = subprocess.Popen([SONARD.parents[1] / "clients/sonarctl", "listen", daemon.address, "--make", "ping360", "--wait",
                                     str(PATIENCE_S)], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
            self.addCleanup(host.wait)
            self.addCleanup(host.terminate)

            def at_the_target():
                """Returns points near the target (4 m away, 20 degrees to port), of clouds whose transform has come."""
                for cloud in list(clouds):
                    try:
                        at = buffer.lookup_transform("rov", cloud.header.frame_id, cloud.header.stamp).transform
                    except TransformException:
                        continue
                    clouds.remove(cloud)
                    turn, place = at.rotation, at.translation
                    for i in range(cloud.width):
                        x, y, z = rotate(wxyz((turn.x, turn.y, turn.z, turn.w)), struct.unpack_from("<3f", cloud.data, i * cloud.point_step))
                        points.append((x + place.x, y + place.y, z + place.z))
                return [point for point in points if math.dist(point, (3.76, 1.37, -0.2)) < 0.2]
            self.spin_until(at_the_target)

    def test_launch_files_start_and_end_all_programs(self):
        for file in ("bridge.launch.py", "sonard.launch.py"):
            ran = subprocess.run([sys.executable, "-B", "-c", ARGUMENTS, str(BRIDGE / "launch" / file)], env=ENVIRONMENT,
                                 capture_output=True, text=True, timeout=PATIENCE_S, check=False)
            self.assertEqual(ran.returncode, 0, ran.stderr)
            for name in ("odometry", "truth_rate_hz", "use_sim_time", "namespace"):
                self.assertIn(f"'{name}'", ran.stdout)


if __name__ == "__main__":
    unittest.main()
