"""Connects a ROS 2 system to sonard. Only `node` needs ROS."""
