"""The tap of a ROS 1 driver: starts the driver and prints a JSON line for each message of a topic.

    python3 -m sonard_client.judge.ros1_tap TOPIC -- COMMAND...

Any message type with a number (ping_id, ping_number or header.seq) and samples (ping_data, image.data or data) will do.
"""
from __future__ import annotations

import json
import subprocess
import sys
import threading
import time
import zlib
from typing import Any


def _field(message: Any, *paths: str) -> Any:
    for path in paths:
        value = message
        for name in path.split("."):
            value = getattr(value, name, None)
        if value is not None:
            return value
    return None


def line_of(message: Any) -> str:
    """The tap line of a message."""
    samples = _field(message, "ping_data", "image.data", "data")
    crc = zlib.crc32(bytes(samples if samples is not None else b""))
    return json.dumps({"id": _field(message, "ping_id", "ping_number", "header.seq"), "crc32": f"{crc:08x}"})


def _subscribe(topic: str) -> None:
    import rospy    # of ROS 1
    import rostopic
    while True:
        try:
            kind, name, _ = rostopic.get_topic_class(topic, blocking=False)
            if kind is not None:
                break
        except Exception:  # the master is not up yet
            pass
        time.sleep(0.2)
    rospy.init_node("sonard_judge", anonymous=True, disable_signals=True)
    rospy.Subscriber(name, kind, lambda message: print(line_of(message), flush=True))


def main() -> int:
    topic, command = sys.argv[1], sys.argv[sys.argv.index("--") + 1:]
    driver = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=sys.stderr)
    threading.Thread(target=_subscribe, args=(topic,), daemon=True).start()
    return driver.wait()


if __name__ == "__main__":
    sys.exit(main())
