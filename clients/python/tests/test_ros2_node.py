"""The node of the ROS 2 bridge, with stand-ins for ROS: poses while other work is slow."""
import contextlib
import http.server
import json
import math
import pathlib
import socket
import struct
import tempfile
import threading
import unittest
from unittest import mock

from ros_stand_ins import PATIENCE_S, Message, Ros, wait_for

from sonard_bridge import live_view, polling
from sonard_bridge.live_view import Transform

HALF = math.sqrt(0.5)
STATUS = {"now_ns": "7500000000", "vehicles": [{"name": "rov", "position": {"x": 1, "z": -3}, "orientation": {"w": 1}}]}


def pose(sec=3, nanosec=500000000, x=1.0, w=HALF, frame="map"):
    of = Message
    return of(header=of(stamp=of(sec=sec, nanosec=nanosec), frame_id=frame),
              pose=of(position=of(x=x, y=2.0, z=-3.0), orientation=of(x=0.0, y=0.0, z=HALF, w=w)))


def odometry(**given):
    of, stamped = Message, pose(**given)
    return of(header=stamped.header, pose=of(pose=stamped.pose), twist=of(twist=of(linear=of(x=1.0, y=0.0, z=0.0))))


def transform(sec, nanosec):
    stamped = pose(sec, nanosec)
    return Message(header=stamped.header, transform=Message(translation=stamped.pose.position, rotation=stamped.pose.orientation))


class SlowServer:
    """Answers the status when the test allows it; counts requests and answers, and stores the last request's headers."""

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
        """Returns the environment of a node that sends its poses here."""
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


class Poses(WithNode):
    def test_frames_named_ned_are_ned(self):
        ros = self.bridge(odometry="/odom")
        (_, call), = ros.subscribed.items()
        for frame, axes in (("world_ned", "NED_FRD"), ("odom/NED", "NED_FRD"), ("planned", "ENU_FLU"), ("", "ENU_FLU")):
            call(odometry(frame=frame))
            line = self.line()
            self.assertEqual((line["frame"], line["position"]), (axes, [1.0, 2.0, -3.0]), frame)
            for got, wanted in zip(line["velocity"], (0, 1, 0)):  # turned by 90 degrees about z
                self.assertAlmostEqual(got, wanted)

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

    def test_warnings_of_one_kind_do_not_hide_others(self):
        ros = self.bridge(odometry="/odom")
        for x in (math.nan, math.inf, math.nan):
            ros.subscribed["/odom"](odometry(x=x))
            ros.node.warn("no status of sonard: timed out")
        self.assertEqual([text.partition(":")[0] for text in ros.logged[1:]], ["left out", "no status of sonard"])

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
            truth = wait_for(lambda: ros.published["~/vehicle_pose"])[0]
        self.assertEqual((truth.pose.position.x, truth.pose.position.z, truth.pose.orientation.w), (1, -3, 1))
        self.assertEqual((truth.header.frame_id, truth.header.stamp.sec, truth.header.stamp.nanosec), ("world", 7, 500000000))

    def test_a_request_without_an_answer_ends(self):
        server = self.server(may_answer=False)
        with mock.patch.object(polling, "LIMIT_S", 0.05):
            ros = self.bridge(odometry="/odom", truth_rate_hz=50.0, http=server.at)
            wait_for(lambda: any("no status of sonard" in text for text in ros.logged))
            wait_for(lambda: server.requests >= 3)

    def test_a_closed_port_is_reported(self):
        ros = self.bridge(odometry="/odom", sonard="127.0.0.1:9")
        def refused():
            ros.subscribed["/odom"](odometry())
            return [text for text in ros.logged if "does not listen" in text]
        wait_for(refused)


class Fails:
    """A publisher's method that raises the first time, then appends."""

    def __init__(self, sent):
        self.sent, self.calls = sent, 0

    def __call__(self, message):
        self.calls += 1
        if self.calls == 1:
            raise RuntimeError("publisher's handle is invalid")
        self.sent.append(message)


class Helpers(WithNode):
    """Threads that continue after errors."""

    def connections(self, *streams):
        """Replaces the live view's connections, one after another; the last one stays open. Returns the connections."""
        made, self.may_go_on = [], threading.Event()
        may_go_on = self.may_go_on

        class Connection:
            def __init__(self, *_):
                made.append(self)
                self.messages = list(streams[min(len(made), len(streams)) - 1])
                self.stream = Message(close=lambda: None)

            def receive(self):
                may_go_on.wait(PATIENCE_S)
                return self.messages.pop(0) if self.messages else threading.Event().wait(0.01) or None

        for name, stand_in in (("Connection", Connection), ("RETRY_S", 0)):
            patch = mock.patch.object(live_view, name, stand_in)
            patch.start()
            self.addCleanup(patch.stop)
        return made

    def test_the_status_is_read_after_a_publisher_fails(self):
        server = self.server(may_answer=False)
        ros = self.bridge(http=server.at, truth_rate_hz=100, truth="/truth")
        ros.node.truth.publish = Fails(ros.published["/truth"])
        server.may_answer.set()
        wait_for(lambda: ros.published["/truth"])
        self.assertEqual([text for text in ros.logged if "invalid" in text],
                         ["""not published: RuntimeError("publisher's handle is invalid")"""])

    def test_messages_of_the_view_are_read_after_a_publisher_fails(self):
        server_info = json.dumps({"op": "serverInfo", "metadata": {"sonard.clock": "stepped"}}).encode()
        made = self.connections([(live_view.TEXT, server_info),
                                 *((live_view.BINARY, struct.pack("<BQ", 2, ns)) for ns in (1, 2))])
        ros = self.bridge(clock=True)
        ros.node.clock_topic.publish = Fails(ros.published["/clock"])
        self.may_go_on.set()
        wait_for(lambda: ros.published["/clock"])
        self.assertEqual([message.clock.nanosec for message in ros.published["/clock"]], [2])
        self.assertEqual(len([text for text in ros.logged if text.startswith("not published: ")]), 1)
        self.assertEqual(len(made), 1)

    def test_the_view_is_read_after_a_malformed_message(self):
        self.connections([(live_view.TEXT, b"[]")], [(live_view.BINARY, struct.pack("<BQ", 2, 7))])
        troubles, times = [], []
        view = live_view.LiveView(("127.0.0.1", 1), "", lambda topic: True, lambda topic, ns, payload: times.append(ns),
                                  troubles.append)
        view.start()
        self.may_go_on.set()
        self.addCleanup(view.join)
        self.addCleanup(view.stop)
        self.assertEqual(wait_for(lambda: times), [7])
        self.assertEqual(len(troubles), 1)
        self.assertIn("the live view cannot be read: AttributeError", troubles[0])


class Transforms(WithNode):
    def test_a_transform_is_sent_when_it_is_new(self):
        ros = self.bridge(tf_parent="map", tf_child="base_link", tf_rate_hz=20)
        (period_s, tick), = ros.timers
        self.assertEqual(period_s, 0.05)
        tick()
        self.assertIn("no transform yet", ros.logged[-1])
        for nanosec in (1, 1, 2):
            ros.transform = lambda nanosec=nanosec: transform(5, nanosec)
            tick()
        self.assertEqual([self.line()["timestamp"] for _ in range(2)], [5.000000001, 5.000000002])

    def test_a_static_transform_is_sent_each_time(self):
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


class Mounts(WithNode):
    def mount(self, child="front", parent="rov", x=0.3, turn=(1.0, 0.0, 0.0, 0.0)):
        return Transform(2_500_000_000, parent, child, (x, 0.0, 0.0), turn)

    def bridge(self, **parameters):
        with mock.patch("sonard_bridge.live_view.LiveView.run"):
            return super().bridge(tf_static=True, **parameters)

    def test_mounts_are_sent_once_and_after_a_change(self):
        ros = self.bridge()
        world = Transform(0, "world", "rov", (9.0, 9.0, 9.0), (1.0, 0.0, 0.0, 0.0))
        for x in (0.3, 0.3 + 1e-9, 0.3):
            ros.node.on_mounts([world, self.mount(x=x), self.mount("left")])
        self.assertEqual(len(ros.static), 1)
        self.assertEqual(ros.quality["/tf_static"].named, {"depth": 1, "durability": "transient local"})
        (front, left), = ros.static
        self.assertEqual((front.header.frame_id, front.child_frame_id, left.child_frame_id), ("rov", "front", "left"))
        self.assertEqual((front.transform.translation.x, front.transform.rotation.w, front.transform.rotation.x), (0.3, 1, 0))
        self.assertEqual((front.header.stamp.sec, front.header.stamp.nanosec), (2, 500000000))
        ros.node.on_mounts([world, self.mount(x=0.4, turn=(HALF, 0.0, HALF, 0.0)), self.mount("left")])
        self.assertEqual([m.child_frame_id for m in ros.static[1]], ["front", "left"])  # all: only the last one is latched
        self.assertEqual(ros.static[1][0].transform.rotation.y, HALF)

    def test_heads_that_turn_are_sent_each_time(self):
        ros = self.bridge(base_frame="base_link")
        away = [(math.cos(half), 0.0, 0.0, math.sin(half)) for half in (0, 0.1, 0.2, 0.2)]
        for turn in away:
            ros.node.on_mounts([self.mount(), self.mount("head", turn=turn)])
        self.assertEqual([[m.child_frame_id for m in message] for message in ros.static], [["front", "head"], ["front"]])
        moved = [message.transforms for message in ros.published["/tf"]]
        self.assertEqual([[m.child_frame_id for m in message] for message in moved], 3 * [["head"]])
        self.assertEqual([message[0].transform.rotation.z for message in moved], [turn[3] for turn in away[1:]])
        self.assertEqual((moved[0][0].header.frame_id, moved[0][0].header.stamp.sec), ("base_link", 2))
        ros.node.on_mounts([self.mount(x=0.5), self.mount("head", turn=away[0])])
        self.assertEqual([m.child_frame_id for m in ros.static[2]], ["front"])
        ros.node.on_mounts([self.mount(x=0.5)])  # the head is removed: nothing is left to turn
        self.assertEqual((len(ros.static), len(ros.published["/tf"])), (3, 4))

    def test_the_parent_changes_with_the_number_of_vehicles(self):
        ros = self.bridge(base_frame="base_link")
        ros.node.on_mounts([self.mount(), self.mount("mast", "boat")])
        ros.node.on_mounts([self.mount(), self.mount("mast", "boat", turn=(HALF, 0.0, 0.0, HALF))])
        ros.node.on_mounts([self.mount()])
        self.assertEqual([{m.child_frame_id: m.header.frame_id for m in message} for message in ros.static],
                         [{"front": "rov", "mast": "boat"}, {"front": "rov"}, {"front": "base_link"}])

    def test_mounts_have_the_right_parent(self):
        both = [self.mount(), self.mount("mast", "boat")]
        for parameters, wanted in (({"base_frame": "base_link"}, {"front": "rov", "mast": "boat"}),
                                   ({"base_frame": "base_link", "vehicle": "rov"}, {"front": "base_link"}),
                                   ({"tf_parent": "map", "tf_child": "hull", "vehicle": "boat"}, {"mast": "hull"})):
            with self.subTest(parameters):
                ros = self.bridge(**parameters)
                ros.node.on_mounts(both)
                self.assertEqual({m.child_frame_id: m.header.frame_id for m in ros.static[0]}, wanted)


class TheClock(WithNode):
    def test_stamps_of_messages_do_not_set_the_clock_back(self):
        with mock.patch("sonard_bridge.live_view.LiveView.run"):
            ros = self.bridge(clock=True)
        ros.node.view.clock = "stepped"
        for topic, ns in (("", 5), ("/tf", 3), ("/tf", 7), ("", 7), ("", 1)):  # the last one: sonard started again
            ros.node.on_view(topic, ns, b"")
        self.assertEqual([m.clock.nanosec for m in ros.published["/clock"]], [5, 7, 1])
        ros.node.view.clock = "follow"
        ros.node.on_view("", 9, b"")
        self.assertEqual(len(ros.published["/clock"]), 3)
        self.assertIn("sonard's clock is follow", ros.logged[-1])


class Token(WithNode):
    def test_the_token_is_sent(self):
        server = self.server()
        server.token = "0123456789abcdef"
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "token"
            file.write_text(server.token + "\n", encoding="utf-8")
            ros = self.bridge(odometry="/odom", truth_rate_hz=100.0, http=server.at, token_file=str(file))
        wait_for(lambda: ros.published["~/vehicle_pose"])

    def test_a_missing_token_is_reported(self):
        server = self.server()
        server.token = "0123456789abcdef"
        ros = self.bridge(odometry="/odom", truth_rate_hz=100.0, http=server.at)
        wait_for(lambda: any("set the parameter token_file" in text for text in ros.logged))


if __name__ == "__main__":
    unittest.main()
