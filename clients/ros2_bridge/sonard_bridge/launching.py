"""The parts that both launch files share: a launch argument for each parameter, and the node."""
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from .parameters import PARAMETERS


def _text(value):
    return str(value).lower() if isinstance(value, bool) else str(value)


def arguments():
    return ([DeclareLaunchArgument(p.name, default_value=_text(p.default), description=p.meaning) for p in PARAMETERS] +
            [DeclareLaunchArgument("use_sim_time", default_value="false", description="take the time from /clock"),
             DeclareLaunchArgument("namespace", default_value="", description="namespace of the node and its topics")])


def bridge():
    """Passes text parameters as text. Otherwise YAML would convert names such as 1 and on to numbers and booleans."""
    given = {p.name: ParameterValue(LaunchConfiguration(p.name), value_type=str) if isinstance(p.default, str)
             else LaunchConfiguration(p.name) for p in PARAMETERS}
    return Node(package="sonard_bridge", executable="bridge", name="sonard_bridge", namespace=LaunchConfiguration("namespace"),
                parameters=[{**given, "use_sim_time": LaunchConfiguration("use_sim_time")}], output="screen")
