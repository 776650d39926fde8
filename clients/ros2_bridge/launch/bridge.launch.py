"""ros2 launch sonard_bridge bridge.launch.py odometry:=/odometry/filtered sonard:=127.0.0.1:14771"""
from launch import LaunchDescription
from sonard_bridge.launching import arguments, bridge


def generate_launch_description():
    return LaunchDescription([*arguments(), bridge()])
