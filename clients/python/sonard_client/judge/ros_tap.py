"""The tap of a ROS driver: starts the driver and prints a JSON line for each message of a topic.

    python3 -m sonard_client.judge.ros_tap ros1|ros2 TOPIC -- COMMAND...

The type of the message must have a number (ping_id, ping_number or header.seq) and samples (ping_data, image.data, intensities or
data), or a velocity and an altitude, also as vx, vy, vz and altitude in its field `report`.
"""
from __future__ import annotations

import importlib
import json
import os
import resource
import signal
import struct
import subprocess
import sys
import threading
import time
import zlib
from typing import Any

GAIN_BYTES = 4  # size of the gain before the samples of a row


def _field(message: Any, *paths: str) -> Any:
    for path in paths:
        value = message
        for name in path.split("."):
            value = getattr(value, name, None)
        if value is not None:
            return value
    return None


def line_of(message: Any) -> str:
    """Returns the line of the tap for a message. If the message has `step` and `n_ranges`, its last n_ranges * step bytes are the
    samples, because ping_data of one driver's Ping begins with the header from the wire. With `has_gains` the gain before each
    row is removed."""
    samples = _field(message, "ping_data", "image.data", "intensities", "data")
    moved = [_field(message, f"velocity.{axis}", f"report.v{axis}") for axis in "xyz"] + [_field(message, "altitude", "report.altitude")]
    if samples is None and None not in moved:
        samples = struct.pack("<4d", *moved)
    data = bytes(samples if samples is not None else b"")
    step, rows = getattr(message, "step", 0), getattr(message, "n_ranges", 0)
    if step and rows:
        data = data[-step * rows:]
    if step > GAIN_BYTES and getattr(message, "has_gains", False):
        data = b"".join(data[at + GAIN_BYTES:at + step] for at in range(0, len(data), step))
    return json.dumps({"id": _field(message, "ping_id", "ping_number", "header.seq"), "crc32": f"{zlib.crc32(data):08x}"})


def _print(message: Any) -> None:
    print(line_of(message), flush=True)


def _subscribe_ros1(topic: str) -> None:
    import rospy
    import rostopic
    while True:
        try:
            kind, name, _ = rostopic.get_topic_class(topic, blocking=False)
            if kind is not None:
                break
        except Exception:  # the ROS master does not run yet
            pass
        time.sleep(0.2)
    rospy.init_node("sonard_judge", anonymous=True, disable_signals=True)
    rospy.Subscriber(name, kind, _print)


def _subscribe_ros2(topic: str) -> None:
    import rclpy
    from rclpy.qos import QoSProfile
    from rclpy.signals import SignalHandlerOptions
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("sonard_judge")
    while not (publishers := node.get_publishers_info_by_topic(topic)):
        time.sleep(0.1)
    package, _, kind = publishers[0].topic_type.split("/")  # "sensor_msgs/msg/Image"
    message = getattr(importlib.import_module(package + ".msg"), kind)
    quality = QoSProfile(depth=100, reliability=publishers[0].qos_profile.reliability)  # must match the publisher
    node.create_subscription(message, topic, _print, quality)
    rclpy.spin(node)


def main() -> int:
    subscribe = {"ros1": _subscribe_ros1, "ros2": _subscribe_ros2}[sys.argv[1]]
    topic, command = sys.argv[2], sys.argv[sys.argv.index("--") + 1:]
    driver = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=sys.stderr)
    threading.Thread(target=subscribe, args=(topic,), daemon=True).start()
    return ended_as(driver.wait())


def ended_as(code: int) -> int:
    """If a signal ended the driver, ends this process with the same signal, so that the judge detects it."""
    if code < 0:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # no second core file
        if -code not in (signal.SIGKILL, signal.SIGSTOP):
            signal.signal(-code, signal.SIG_DFL)
        os.kill(os.getpid(), -code)
    return code


if __name__ == "__main__":
    sys.exit(main())
