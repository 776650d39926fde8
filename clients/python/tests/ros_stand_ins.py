"""Modules with the names that the ROS 2 bridge imports, for tests without ROS. They record calls and do not test ROS itself."""
import contextlib
import importlib
import sys
import threading
import types
from unittest import mock

from common import ROOT

BRIDGE = ROOT / "clients/ros2_bridge"
sys.path.insert(0, str(BRIDGE))
PATIENCE_S = 300


def wait_for(found):
    """Waits until found() returns a value, and returns it."""
    for _ in range(100 * PATIENCE_S):
        if result := found():
            return result
        threading.Event().wait(0.01)
    raise AssertionError("did not come")


class Message:
    """A message of any type: nested messages are made when they are accessed."""

    def __init__(self, **values):
        vars(self).update(values)

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        child = Message()
        setattr(self, name, child)
        return child


class Recorded:
    """A call of a class or function: its arguments."""

    def __init__(self, *arguments, **named):
        self.arguments, self.named = arguments, named


class NoTransform(Exception):
    pass


class ExternalShutdown(Exception):
    pass


class Ros:
    """The environment of one node. `parameters`: as on its command line."""

    def __init__(self, **parameters):
        ros = self
        self.parameters, self.declared = parameters, {}
        self.logged, self.subscribed, self.timers, self.published, self.quality = [], {}, [], {}, {}
        self.steady_timers, self.is_ok = [], True
        self.now_ns, self.transform, self.spin, self.shut_down = 0, None, lambda node: None, 0

        class Node:
            def __init__(self, name):
                self.context = types.SimpleNamespace(ok=lambda: True)

            def declare_parameter(self, name, default, descriptor=None):
                ros.declared[name] = default, descriptor
                return types.SimpleNamespace(value=parameters.get(name, default))

            def create_subscription(self, kind, topic, call, qos):
                ros.subscribed[topic] = call

            def create_publisher(self, kind, topic, qos):
                ros.quality[topic] = qos
                sent = ros.published.setdefault(topic, [])
                return types.SimpleNamespace(publish=sent.append)

            def create_timer(self, period_s, call, clock=None):
                (ros.timers if clock is None else ros.steady_timers).append((period_s, call))

            def get_clock(self):
                return types.SimpleNamespace(now=lambda: types.SimpleNamespace(nanoseconds=ros.now_ns))

            def get_logger(self):
                def log(text, **_):
                    ros.logged.append(text)
                return types.SimpleNamespace(info=log, warning=log)

            def destroy_node(self):
                pass

        class Buffer:
            def lookup_transform(self, parent, child, at):
                if ros.transform is None:
                    raise NoTransform(f"{child} in {parent}")
                return ros.transform()

        def message(*names):
            return {name: Message for name in names}

        def shut():
            ros.shut_down += 1

        made = {"rclpy": {"init": lambda: None, "spin": lambda node: ros.spin(node), "try_shutdown": shut,
                          "ok": lambda: ros.is_ok, "time": types.SimpleNamespace(Time=object)},
                "rclpy.clock": {"Clock": Recorded, "ClockType": types.SimpleNamespace(STEADY_TIME="steady")},
                "rclpy.node": {"Node": Node}, "rclpy.qos": {"qos_profile_sensor_data": 5, "QoSProfile": Recorded,
                              "DurabilityPolicy": types.SimpleNamespace(TRANSIENT_LOCAL="transient local")},
                "rclpy.executors": {"ExternalShutdownException": ExternalShutdown},
                "geometry_msgs": {}, "geometry_msgs.msg": message("PoseStamped", "TransformStamped"),
                "nav_msgs": {}, "nav_msgs.msg": message("Odometry"),
                "rcl_interfaces": {}, "rcl_interfaces.msg": message("ParameterDescriptor"),
                "rosgraph_msgs": {}, "rosgraph_msgs.msg": message("Clock"),
                "sensor_msgs": {}, "sensor_msgs.msg": message("LaserScan", "PointCloud2", "PointField"),
                "tf2_msgs": {}, "tf2_msgs.msg": message("TFMessage"),
                "tf2_ros": {"Buffer": Buffer, "TransformException": NoTransform, "TransformListener": Recorded}}
        self.modules = modules_of(made)

    @property
    def static(self):
        """The transforms of each message on /tf_static."""
        return [message.transforms for message in self.published.get("/tf_static", [])]

    @contextlib.contextmanager
    def module(self):
        """Provides sonard_bridge.node in this environment."""
        with mock.patch.dict(sys.modules, self.modules):
            sys.modules.pop("sonard_bridge.node", None)
            try:
                yield importlib.import_module("sonard_bridge.node")
            finally:
                sys.modules.pop("sonard_bridge.node", None)


def modules_of(made):
    modules = {name: types.ModuleType(name) for name in made}
    for name, content in made.items():
        vars(modules[name]).update(content)
    return modules


def launch_modules():
    """launch and launch_ros: every action is a Recorded, and a LaunchConfiguration has the value in its context."""
    class LaunchConfiguration(Recorded):
        def perform(self, context):
            return context[self.arguments[0]]

    def recorded(*names):
        return {name: type(name, (Recorded,), {}) for name in names}

    return modules_of({
        "launch": recorded("LaunchDescription"),
        "launch.actions": recorded("DeclareLaunchArgument", "ExecuteProcess", "OpaqueFunction", "RegisterEventHandler",
                                   "Shutdown"),
        "launch.event_handlers": recorded("OnProcessIO"),
        "launch.substitutions": {"LaunchConfiguration": LaunchConfiguration},
        "launch_ros": {}, "launch_ros.actions": recorded("Node"),
        "launch_ros.parameter_descriptions": recorded("ParameterValue")})
