"""The node of the ROS 2 bridge with stand-ins for ROS: poses, whatever else is slow."""
import contextlib
import http.server
import json
import math
import socket
import threading
import unittest
from unittest import mock

from ros_stand_ins import Message, Ros

from sonard_bridge import polling

HALF = math.sqrt(0.5)
PATIENCE_S = 60
STATUS = {"now_ns": "7500000000", "vehicles": [{"name": "rov", "position": {"x": 1, "z": -3}, "orientation": {"w": 1}}]}


def pose(sec=3, nanosec=500000000, x=1.0, w=HALF):
    of = Message
    return of(header=of(stamp=of(sec=sec, nanosec=nanosec)),
              pose=of(position=of(x=x, y=2.0, z=-3.0), orientation=of(x=0.0, y=0.0, z=HALF, w=w)))


def odometry(**given):
    of, stamped = Message, pose(**given)
    return of(header=stamped.header, pose=of(pose=stamped.pose), twist=of(twist=of(linear=of(x=1.0, y=0.0, z=0.0))))


def transform(sec, nanosec):
    stamped = pose(sec, nanosec)
    return Message(header=stamped.header, transform=Message(translation=stamped.pose.position, rotation=stamped.pose.orientation))


class SlowServer:
    """Answers the status when it may; counts requests and answers, and keeps the last request's header."""

    def __init__(self, may_answer=True):
        outer = self
        self.may_answer, self.asked, self.answered = threading.Event(), threading.Semaphore(0), 0
        self.requests, self.header, self.token = 0, {}, ""
        if may_answer:
            self.may_answer.set()

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                outer.requests += 1
                outer.header = dict(self.headers)
                outer.asked.release()
                outer.may_answer.wait(PATIENCE_S)
                is_allowed = not outer.token or self.headers.get("Authorization") == "Bearer " + outer.token
                body = json.dumps(STATUS if is_allowed else {}).encode()
                with contextlib.suppress(OSError):
                    self.send_response(200 if is_allowed else 401)
                    self.send_header("Content-Length", str(len(body)))
                    self.end_headers()
                    self.wfile.write(body)
                    outer.answered += 1

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.at = "127.0.0.1:%d" % self.server.server_port
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def close(self):
        self.may_answer.set()
        self.server.shutdown()
        self.server.server_close()


class WithNode(unittest.TestCase):
    def setUp(self):
        self.there = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(self.there.close)
        self.there.bind(("127.0.0.1", 0))
        self.there.settimeout(PATIENCE_S)

    def bridge(self, **parameters):
        """The surroundings of a node that sends its poses here."""
        ros = Ros(**{"sonard": "127.0.0.1:%d" % self.there.getsockname()[1], **parameters})
        module = ros.module()
        node_module = module.__enter__()
        self.addCleanup(module.__exit__, None, None, None)
        ros.node = node_module.Bridge()
        self.addCleanup(ros.node.close)
        return ros

    def server(self, **given):
        server = SlowServer(**given)
        self.addCleanup(server.close)
        return server

    def line(self):
        return json.loads(self.there.recv(4096))

    @staticmethod
    def wait_for(found):
        """What found() gives once it is something."""
        for _ in range(100 * PATIENCE_S):
            if found():
                return found()
            threading.Event().wait(0.01)
        raise AssertionError("did not come")


class Poses(WithNode):
    def test_odometry_becomes_a_datagram(self):
        ros = self.bridge(odometry="/odom", vehicle="rov")
        (topic, call), = ros.subscribed.items()
        self.assertEqual(topic, "/odom")
        call(odometry())
        line = self.line()
        self.assertEqual((line["position"], line["timestamp"], line["vehicle"]), ([1, 2, -3], 3.5, "rov"))
        self.assertAlmostEqual(line["velocity"][1], 1)
        call(odometry(w=0.0))
        self.assertIn("left out: orientation", ros.logged[-1])

    def test_a_slow_answer_starves_no_pose(self):
        server = self.server(may_answer=False)
        with mock.patch.object(polling, "LIMIT_S", PATIENCE_S):
            ros = self.bridge(odometry="/odom", truth_rate_hz=100.0, http=server.at)
            self.assertTrue(server.asked.acquire(timeout=PATIENCE_S))
            for i in range(600):  # as the executor does it: everything in one thread
                for _, call in ros.timers:
                    call()
                ros.subscribed["/odom"](odometry(x=float(i)))
                self.assertEqual(self.line()["position"][0], i)
            self.assertEqual((server.requests, server.answered), (1, 0))
            server.may_answer.set()
            truth = self.wait_for(lambda: ros.published["~/vehicle_pose"])[0]
        self.assertEqual((truth.pose.position.x, truth.pose.position.z, truth.pose.orientation.w), (1, -3, 1))
        self.assertEqual((truth.header.frame_id, truth.header.stamp.sec, truth.header.stamp.nanosec), ("world", 7, 500000000))

    def test_a_request_without_an_answer_ends(self):
        server = self.server(may_answer=False)
        with mock.patch.object(polling, "LIMIT_S", 0.05):
            ros = self.bridge(odometry="/odom", truth_rate_hz=50.0, http=server.at)
            self.wait_for(lambda: any("no status of sonard" in text for text in ros.logged))
            self.wait_for(lambda: server.requests >= 3)

    def test_a_closed_port_is_said(self):
        ros = self.bridge(odometry="/odom", sonard="127.0.0.1:9")
        def refused():
            ros.subscribed["/odom"](odometry())
            return [text for text in ros.logged if "does not listen" in text]
        self.wait_for(refused)


class Transforms(WithNode):
    def test_a_transform_is_sent_when_it_is_new(self):
        ros = self.bridge(tf_parent="map", tf_child="base_link", tf_rate_hz=20.0)
        (period_s, tick), = ros.timers
        self.assertEqual(period_s, 0.05)
        tick()
        self.assertIn("no transform yet", ros.logged[-1])
        for nanosec in (1, 1, 2):
            ros.transform = lambda nanosec=nanosec: transform(5, nanosec)
            tick()
        self.assertEqual([self.line()["timestamp"] for _ in range(2)], [5.000000001, 5.000000002])

    def test_a_static_one_is_kept_fresh(self):
        ros = self.bridge(tf_parent="map", tf_child="base_link")
        (_, tick), = ros.timers
        ros.transform = lambda: transform(0, 0)
        for ns in (4_000_000_000, 4_020_000_000):
            ros.now_ns = ns
            tick()
            self.assertEqual(self.line()["timestamp"], ns / 1e9)
        ros.now_ns = 0  # simulation time that has not begun
        tick()
        self.assertNotIn("timestamp", self.line())


class Sources(unittest.TestCase):
    def test_one_is_needed(self):
        for parameters in ({}, {"odometry": "/a", "pose": "/b"}, {"tf_parent": "map"}, {"tf_child": "base_link"}):
            with self.subTest(**parameters), Ros(**parameters).module() as node, self.assertRaisesRegex(ValueError, "set one of"):
                node.Bridge()


if __name__ == "__main__":
    unittest.main()
