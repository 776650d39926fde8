"""The node. It sends the poses of one ROS source to sonard over UDP and can publish sonard's data as topics. The executor's
thread sends the poses and never blocks; other threads receive the data from sonard."""
from __future__ import annotations

import array
import math
import socket
import sys
import time
from typing import Dict, Optional, Sequence, Set, Tuple

import rclpy
from geometry_msgs.msg import PoseStamped, TransformStamped
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.clock import Clock as RosClock
from rclpy.clock import ClockType
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan, PointCloud2, PointField
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer, TransformException, TransformListener

from . import live_view
from .conversions import Unusable, axes_of, json_line, name_in_topic, scan_of, stamp_ns, stamp_s, vehicle_in, wxyz, xyzw
from .parameters import PARAMETERS, BadParameter, checked
from .polling import StatusPoll

WAKE_S = 0.5  # period of a timer that makes the executor notice the end of the context
SAME = 1e-6  # tolerance for a mount: metres, and parts of a quaternion


def set_stamp(stamp, ns: int) -> None:
    stamp.sec, stamp.nanosec = divmod(ns, 10**9)


def is_near(a: Sequence[float], b: Sequence[float]) -> bool:
    return all(abs(x - y) <= SAME for x, y in zip(a, b))


def is_same(a: live_view.Transform, b: live_view.Transform) -> bool:
    return a.parent == b.parent and is_near((*a.position, *a.orientation), (*b.position, *b.orientation))


def has_turned(before: live_view.Transform, now: live_view.Transform) -> bool:
    """Returns true if the sonar turns but stays in place, as the head of a scanning sonar does with every line."""
    return before.parent == now.parent and is_near(before.position, now.position) and not is_same(before, now)


class Bridge(Node):
    """Reads poses from one source: the topic in the parameter odometry or pose, or the transform from tf_parent to tf_child."""

    def __init__(self) -> None:
        super().__init__("sonard_bridge")
        given = {p.name: self.declare_parameter(p.name, p.default, ParameterDescriptor(description=p.meaning, read_only=True,
                                                                                      dynamic_typing=True)).value
                 for p in PARAMETERS}
        self.settings = wanted = checked(given)
        self.vehicle, self.use_stamps = wanted["vehicle"], wanted["use_stamps"]
        self.helpers = []  # threads
        self.warned: Dict[str, float] = {}  # time of the latest warning of each kind
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setblocking(False)
        try:
            self.socket.connect(wanted["sonard"])
        except OSError as error:
            self.socket.close()
            raise BadParameter("sonard", f"{wanted['sonard'][0]} is not an address: {error.strerror or error}") from None
        if wanted["odometry"]:
            self.create_subscription(Odometry, wanted["odometry"], self.on_odometry, qos_profile_sensor_data)
        elif wanted["pose"]:
            self.create_subscription(PoseStamped, wanted["pose"], self.on_pose, qos_profile_sensor_data)
        elif wanted["tf_child"]:
            self.frames = wanted["tf_parent"], wanted["tf_child"]
            self.last_tf: Optional[Tuple[int, int]] = None
            self.buffer = Buffer()
            self.listener = TransformListener(self.buffer, self)
            self.create_timer(1 / wanted["tf_rate_hz"], self.on_tf)
        source = wanted["odometry"] or wanted["pose"] or wanted["tf_child"]
        if wanted["truth_rate_hz"]:
            self.truth = self.create_publisher(PoseStamped, wanted["truth"], 10)
            self.helpers.append(StatusPoll(wanted["http"], wanted["token"], wanted["truth_rate_hz"],
                                           self.while_running(self.on_status), self.warn))
        if any(wanted[name] for name in ("tf_static", "clouds", "scans", "clock")):
            self.look()
        for helper in self.helpers:
            helper.start()
        to = "{}:{}".format(*wanted["sonard"])
        self.get_logger().info(f"poses from {source} to sonard at {to}" if source else "no poses are sent: no source is set")

    def close(self) -> None:
        for helper in self.helpers:
            helper.stop()
        deadline = time.monotonic() + 2  # for all threads together; a thread that still waits for a reply ends with the program
        for helper in self.helpers:
            if helper.is_alive():
                helper.join(max(0.0, deadline - time.monotonic()))
        self.socket.close()

    def warn(self, text: str) -> None:
        """Logs a warning, at most one of each kind in 5 s. The text up to the first colon is the kind."""
        kind, now = text.partition(":")[0], time.monotonic()
        if self.context.ok() and now - self.warned.get(kind, -math.inf) >= 5:
            self.warned[kind] = now
            self.get_logger().warning(text)

    def while_running(self, call):
        """Wraps a callback of another thread: an error is logged and does not end the thread. Nothing is logged while the context
        ends."""
        def guarded(*arguments):
            try:
                call(*arguments)
            except Exception as error:  # any class, because the exceptions of rclpy differ between its releases
                self.warn(f"not published: {error!r}")
        return guarded

    # ---- poses to sonard

    def send(self, header, position, orientation, velocity=None) -> None:
        stamp = stamp_s(header.stamp.sec, header.stamp.nanosec) if self.use_stamps else None
        try:
            self.socket.send(json_line((position.x, position.y, position.z),
                                       wxyz((orientation.x, orientation.y, orientation.z, orientation.w)), stamp, self.vehicle,
                                       None if velocity is None else (velocity.x, velocity.y, velocity.z), axes_of(header.frame_id)))
        except Unusable as error:
            self.warn(f"left out: {error}")
        except BlockingIOError:
            pass  # the next pose is newer
        except OSError as error:
            self.warn(f"sonard does not listen: {error}")

    def on_odometry(self, message: Odometry) -> None:
        self.send(message.header, message.pose.pose.position, message.pose.pose.orientation, message.twist.twist.linear)

    def on_pose(self, message: PoseStamped) -> None:
        self.send(message.header, message.pose.position, message.pose.orientation)

    def on_tf(self) -> None:
        try:
            found = self.buffer.lookup_transform(*self.frames, rclpy.time.Time())
        except TransformException as error:
            self.warn(f"no transform yet: {error}")
            return
        stamp = found.header.stamp.sec, found.header.stamp.nanosec
        if stamp == (0, 0):  # a chain of static transforms has no stamp; with the present time the pose does not become stale
            set_stamp(found.header.stamp, self.get_clock().now().nanoseconds)
        elif stamp == self.last_tf:  # already sent
            return
        self.last_tf = stamp
        self.send(found.header, found.transform.translation, found.transform.rotation)

    # ---- sonard's data as topics

    def on_status(self, status) -> None:
        found = vehicle_in(status, self.vehicle)
        if found is None:
            self.warn("sonard's status has no such vehicle; set the parameter vehicle")
            return
        message = PoseStamped()
        message.header.frame_id = "world"
        set_stamp(message.header.stamp, stamp_ns(status))
        p, q = message.pose.position, message.pose.orientation
        p.x, p.y, p.z = found[0]
        q.x, q.y, q.z, q.w = xyzw(found[1])
        self.truth.publish(message)

    def look(self) -> None:
        wanted = self.settings
        self.mounts: Dict[str, live_view.Transform] = {}  # the last ones received
        self.fixed: Dict[str, live_view.Transform] = {}  # those last published on /tf_static
        self.turning: Set[str] = set()  # sonars whose heads turn
        self.of_sonars = {}  # publishers, by topic
        self.last_clock_ns = -1
        if wanted["tf_static"]:
            # Subscribers that come later get the last message. The StaticTransformBroadcaster of Jazzy ignores changes of a known frame.
            latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
            self.static = self.create_publisher(TFMessage, "/tf_static", latched)
            self.moving = self.create_publisher(TFMessage, "/tf", 10)
        if wanted["clock"]:
            self.clock_topic = self.create_publisher(Clock, "/clock", 10)
        endings = [ending for name, ending in (("clouds", "/cloud"), ("scans", "/truth")) if wanted[name]]
        self.view = live_view.LiveView(wanted["http"], wanted["token"],
                                       lambda topic: topic == "/tf" or any(topic.endswith(ending) for ending in endings),
                                       self.while_running(self.on_view), self.warn,
                                       wanted["cloud_threshold"] if wanted["clouds"] else None)
        self.helpers.append(self.view)

    def on_view(self, topic: str, ns: int, payload: bytes) -> None:
        """Runs in the thread of LiveView."""
        if self.settings["clock"] and (topic == "" or ns > self.last_clock_ns):  # the stamp of a ping may be older than the latest time
            self.on_time(ns)
        if topic == "/tf" and self.settings["tf_static"]:
            self.on_mounts(live_view.transforms(payload))
        elif topic.endswith("/cloud"):
            self.on_cloud(topic, live_view.cloud(payload))
        elif topic.endswith("/truth"):
            self.on_truth(topic, live_view.truth(payload))

    def on_time(self, ns: int) -> None:
        if self.view.clock not in ("stepped", "lockstep"):
            self.warn(f"no /clock: sonard's clock is {self.view.clock or 'not known'}, not stepped or lockstep")
        elif ns != self.last_clock_ns:
            self.last_clock_ns = ns
            message = Clock()
            set_stamp(message.clock, ns)
            self.clock_topic.publish(message)

    def on_mounts(self, transforms) -> None:
        """Publishes mounts on /tf_static when one changes, and those of turning heads on /tf each time."""
        now = {t.child: t for t in transforms if t.parent != "world" and self.vehicle in ("", t.parent)}
        before, self.mounts = self.mounts, now
        self.turning = {name for name in now if name in self.turning or (name in before and has_turned(before[name], now[name]))}
        base = self.settings["base_frame"] or self.settings["tf_child"]
        base = base if len({t.parent for t in now.values()}) == 1 else ""
        fixed = {name: t._replace(parent=base or t.parent) for name, t in now.items() if name not in self.turning}
        if fixed.keys() != self.fixed.keys() or not all(is_same(t, self.fixed[name]) for name, t in fixed.items()):
            self.fixed = fixed
            self.static.publish(TFMessage(transforms=list(map(self.mount, fixed.values()))))
        if self.turning:
            self.moving.publish(TFMessage(transforms=[self.mount(now[name]._replace(parent=base or now[name].parent))
                                                      for name in sorted(self.turning)]))

    @staticmethod
    def mount(t: live_view.Transform) -> TransformStamped:
        message = TransformStamped()
        set_stamp(message.header.stamp, t.stamp_ns)
        message.header.frame_id, message.child_frame_id = t.parent, t.child
        place, turn = message.transform.translation, message.transform.rotation
        place.x, place.y, place.z = t.position
        turn.x, turn.y, turn.z, turn.w = xyzw(t.orientation)
        return message

    def publisher_of(self, kind, topic: str, ending: str):
        name = f"~/{name_in_topic(topic.split('/')[1])}/{ending}"
        if name not in self.of_sonars:
            self.of_sonars[name] = self.create_publisher(kind, name, 5)
        return self.of_sonars[name]

    def on_cloud(self, topic: str, cloud: live_view.Cloud) -> None:
        message = PointCloud2()
        set_stamp(message.header.stamp, cloud.stamp_ns)
        message.header.frame_id = cloud.frame
        message.height, message.width = 1, len(cloud.data) // cloud.stride
        message.fields = [PointField(name=name, offset=offset, datatype=kind, count=1) for name, offset, kind in cloud.columns]
        message.is_bigendian, message.is_dense = False, True
        message.point_step, message.row_step = cloud.stride, cloud.stride * message.width
        message.data = array.array("B", cloud.data[:message.row_step])
        self.publisher_of(PointCloud2, topic, "cloud").publish(message)

    def on_truth(self, topic: str, truth: live_view.Truth) -> None:
        try:
            scan = scan_of(truth.azimuth_rad, truth.range_m)
        except Unusable:
            return  # a sonar with one beam makes no scan
        message = LaserScan()
        set_stamp(message.header.stamp, truth.stamp_ns)
        message.header.frame_id = topic.split("/")[1]
        message.angle_min, message.angle_increment = scan.first_rad, scan.step_rad
        message.angle_max = scan.first_rad + scan.step_rad * (len(scan.range_m) - 1)
        message.range_min, message.range_max = truth.nearest_m, truth.furthest_m
        message.ranges = scan.range_m
        self.publisher_of(LaserScan, topic, "scan").publish(message)


def main() -> int:
    rclpy.init()
    node = None
    try:
        node = Bridge()
        # At a signal rclpy wakes its executor before it ends the context. The executor may then wait again, for ever if no message
        # comes. This timer wakes it; its clock is steady, because a simulation can stop ROS time.
        node.create_timer(WAKE_S, lambda: None, clock=RosClock(clock_type=ClockType.STEADY_TIME))
        rclpy.spin(node)
    except BadParameter as error:
        print(f"sonard_bridge: {error}", file=sys.stderr)
        return 2
    except (KeyboardInterrupt, ExternalShutdownException):  # Ctrl-C; SIGTERM, as systemd and containers send it
        pass
    except Exception:
        if rclpy.ok():
            raise
        # The signal came while rclpy created the node or prepared to wait. Either can then raise various exceptions; none is an error.
    finally:
        if node is not None:
            node.close()
            node.destroy_node()
        rclpy.try_shutdown()
    return 0
