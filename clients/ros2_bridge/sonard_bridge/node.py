"""The node: one source of poses in, to sonard by UDP; and, if wished, the pose that sonard uses as a topic."""
from __future__ import annotations

import json
import socket
import urllib.request

import rclpy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from tf2_ros import Buffer, TransformException, TransformListener

from .conversions import Unusable, endpoint, json_line, stamp_s, vehicle_in, wxyz, xyzw

JSON_PORT, HTTP_PORT = 14771, 8088


class Bridge(Node):
    """Exactly one of the parameters odometry, pose, and the pair tf_parent and tf_child says where poses come from."""

    def __init__(self) -> None:
        super().__init__("sonard_bridge")
        text = {name: str(self.declare_parameter(name, default).value) for name, default in
                (("odometry", ""), ("pose", ""), ("tf_parent", ""), ("tf_child", ""), ("vehicle", ""),
                 ("sonard", f"127.0.0.1:{JSON_PORT}"), ("http", f"127.0.0.1:{HTTP_PORT}"), ("truth", "~/vehicle_pose"))}
        self.vehicle = text["vehicle"]
        self.use_stamps = bool(self.declare_parameter("use_stamps", True).value)
        tf_rate_hz = float(self.declare_parameter("tf_rate_hz", 50.0).value)
        truth_rate_hz = float(self.declare_parameter("truth_rate_hz", 0.0).value)
        sources = [name for name in ("odometry", "pose", "tf_child") if text[name]]
        if len(sources) != 1 or bool(text["tf_parent"]) != bool(text["tf_child"]):
            raise ValueError("set one of the parameters odometry, pose, or tf_parent with tf_child")
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect(endpoint(text["sonard"], JSON_PORT))
        if text["odometry"]:
            self.create_subscription(Odometry, text["odometry"], self.on_odometry, qos_profile_sensor_data)
        elif text["pose"]:
            self.create_subscription(PoseStamped, text["pose"], self.on_pose, qos_profile_sensor_data)
        else:
            self.frames = text["tf_parent"], text["tf_child"]
            self.last_tf = None
            self.buffer = Buffer()
            self.listener = TransformListener(self.buffer, self)
            self.create_timer(1 / tf_rate_hz, self.on_tf)
        if truth_rate_hz > 0:
            host, port = endpoint(text["http"], HTTP_PORT)
            self.status_url = f"http://{host}:{port}/api/v1/status"
            self.truth = self.create_publisher(PoseStamped, text["truth"], 10)
            self.create_timer(1 / truth_rate_hz, self.on_truth)
        self.get_logger().info(f"poses from {text[sources[0]]} to sonard at {text['sonard']}")

    def send(self, header, position, orientation, velocity=None) -> None:
        stamp = stamp_s(header.stamp.sec, header.stamp.nanosec) if self.use_stamps else None
        try:
            self.socket.send(json_line((position.x, position.y, position.z),
                                       wxyz((orientation.x, orientation.y, orientation.z, orientation.w)), stamp, self.vehicle,
                                       None if velocity is None else (velocity.x, velocity.y, velocity.z)))
        except Unusable as error:
            self.get_logger().warning(f"left out: {error}", throttle_duration_sec=5.0)
        except OSError as error:
            self.get_logger().warning(f"sonard does not listen: {error}", throttle_duration_sec=5.0)

    def on_odometry(self, message: Odometry) -> None:
        self.send(message.header, message.pose.pose.position, message.pose.pose.orientation, message.twist.twist.linear)

    def on_pose(self, message: PoseStamped) -> None:
        self.send(message.header, message.pose.position, message.pose.orientation)

    def on_tf(self) -> None:
        try:
            found = self.buffer.lookup_transform(*self.frames, rclpy.time.Time())
        except TransformException as error:
            self.get_logger().warning(f"no transform yet: {error}", throttle_duration_sec=5.0)
            return
        stamp = found.header.stamp.sec, found.header.stamp.nanosec
        if stamp != self.last_tf:  # the newest one, once
            self.last_tf = stamp
            self.send(found.header, found.transform.translation, found.transform.rotation)

    def on_truth(self) -> None:
        try:
            with urllib.request.urlopen(self.status_url, timeout=1.0) as answer:
                found = vehicle_in(json.load(answer), self.vehicle)
        except (OSError, ValueError) as error:
            self.get_logger().warning(f"no status of sonard: {error}", throttle_duration_sec=5.0)
            return
        if found is None:
            self.get_logger().warning("sonard's status has no such vehicle; set the parameter vehicle", throttle_duration_sec=5.0)
            return
        message = PoseStamped()
        message.header.frame_id = "world"
        message.header.stamp = self.get_clock().now().to_msg()
        p, q = message.pose.position, message.pose.orientation
        p.x, p.y, p.z = found[0]
        q.x, q.y, q.z, q.w = xyzw(found[1])
        self.truth.publish(message)


def main() -> None:
    rclpy.init()
    node = Bridge()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        node.get_logger().info("ends")
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
