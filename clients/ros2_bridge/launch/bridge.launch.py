"""ros2 launch sonard_bridge bridge.launch.py odometry:=/odometry/filtered sonard:=127.0.0.1:14771"""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

ARGUMENTS = {"odometry": "", "pose": "", "tf_parent": "", "tf_child": "", "vehicle": "", "sonard": "127.0.0.1:14771"}


def generate_launch_description():
    given = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    return LaunchDescription([DeclareLaunchArgument(name, default_value=value) for name, value in ARGUMENTS.items()] +
                             [Node(package="sonard_bridge", executable="bridge", name="sonard_bridge", parameters=[given])])
