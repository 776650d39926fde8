"""Starts sonard and, when it is ready, the bridge, an autopilot and a driver. When sonard ends, all of them end.

ros2 launch sonard_bridge sonard.launch.py config:=dive.yaml odometry:=/odom driver:="ros2 launch oculus_ros2 default.launch.py"
"""
import shlex

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, RegisterEventHandler, Shutdown
from launch.event_handlers import OnProcessIO
from launch.substitutions import LaunchConfiguration
from sonard_bridge.launching import arguments, bridge

READY = b"ready in "


def start(context):
    def value(name):
        return LaunchConfiguration(name).perform(context)

    command = [value("program"), "run", value("config") or "--demo", *shlex.split(value("options"))]
    sonard = ExecuteProcess(cmd=command, name="sonard", output="screen", on_exit=Shutdown(reason="sonard has ended"))
    then = [bridge()]
    for name in ("autopilot", "driver"):
        if value(name):
            then.append(ExecuteProcess(cmd=shlex.split(value(name)), name=name, output="screen"))
    received = bytearray()

    def on_output(event):
        if not then:
            return []
        received.extend(event.text)
        if READY not in received:
            return []
        started = list(then)
        then.clear()
        return started

    return [RegisterEventHandler(OnProcessIO(target_action=sonard, on_stdout=on_output, on_stderr=on_output)), sonard]


def generate_launch_description():
    own = {"program": ("sonard", "the daemon"), "config": ("", "its configuration; empty: the demo"),
           "options": ("", "more of its command line, such as --clock stepped"),
           "autopilot": ("", "command that starts an autopilot, simulated or not; empty: none"),
           "driver": ("", "command that starts a driver; empty: none")}
    declared = [DeclareLaunchArgument(name, default_value=value, description=meaning) for name, (value, meaning) in own.items()]
    return LaunchDescription([*declared, *arguments(), OpaqueFunction(function=start)])
