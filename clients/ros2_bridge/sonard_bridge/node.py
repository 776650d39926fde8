"""The node: one source of poses in, to sonard by UDP; and, if wished, the pose that sonard uses as a topic. The executor's
thread sends poses and waits for nothing; what is requested of sonard arrives in a thread of its own."""
from __future__ import annotations

import socket
import sys
from typing import Optional, Tuple

import rclpy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from tf2_ros import Buffer, TransformException, TransformListener

from .conversions import Unusable, json_line, stamp_ns, stamp_s, vehicle_in, wxyz, xyzw
from .parameters import PARAMETERS, BadParameter, checked
from .polling import StatusPoll


def set_stamp(stamp, ns: int) -> None:
    stamp.sec, stamp.nanosec = divmod(ns, 10**9)


class Bridge(Node):
    """One of the parameters odometry, pose, and the pair tf_parent and tf_child says where poses come from."""

    def __init__(self) -> None:
        super().__init__("sonard_bridge")
        given = {p.name: self.declare_parameter(p.name, p.default, ParameterDescriptor(description=p.meaning, read_only=True,
                                                                                      dynamic_typing=True)).value
                 for p in PARAMETERS}
        self.settings = wanted = checked(given)
        self.vehicle, self.use_stamps = wanted["vehicle"], wanted["use_stamps"]
        self.helpers = []  # threads
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
        for helper in self.helpers:
            helper.start()
        to = "{}:{}".format(*wanted["sonard"])
        self.get_logger().info(f"poses from {source} to sonard at {to}" if source else "no poses are sent: no source is set")

    def close(self) -> None:
        for helper in self.helpers:
            helper.stop()
        for helper in self.helpers:
            if helper.is_alive():
                helper.join(2.0)
        self.socket.close()

    def warn(self, text: str) -> None:
        if self.context.ok():
            self.get_logger().warning(text, throttle_duration_sec=5.0)

    def while_running(self, call):
        """For a helper's thread, which may publish while the context ends."""
        def guarded(*arguments):
            try:
                call(*arguments)
            except Exception:  # rclpy's own classes differ between releases
                if self.context.ok():
                    raise
        return guarded

    # ---- poses to sonard

    def send(self, header, position, orientation, velocity=None) -> None:
        stamp = stamp_s(header.stamp.sec, header.stamp.nanosec) if self.use_stamps else None
        try:
            self.socket.send(json_line((position.x, position.y, position.z),
                                       wxyz((orientation.x, orientation.y, orientation.z, orientation.w)), stamp, self.vehicle,
                                       None if velocity is None else (velocity.x, velocity.y, velocity.z)))
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
        if stamp == (0, 0):  # static transforms alone have no time: one of now, so that the vehicle does not become stale
            set_stamp(found.header.stamp, self.get_clock().now().nanoseconds)
        elif stamp == self.last_tf:  # the newest one, once
            return
        self.last_tf = stamp
        self.send(found.header, found.transform.translation, found.transform.rotation)

    # ---- what sonard knows, as topics

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


def main() -> int:
    rclpy.init()
    node = None
    try:
        node = Bridge()
        rclpy.spin(node)
    except BadParameter as error:
        print(f"sonard_bridge: {error}", file=sys.stderr)
        return 2
    except (KeyboardInterrupt, ExternalShutdownException):  # Ctrl-C; SIGTERM, as systemd and containers send it
        pass
    finally:
        if node is not None:
            node.close()
            node.destroy_node()
        rclpy.try_shutdown()
    return 0
