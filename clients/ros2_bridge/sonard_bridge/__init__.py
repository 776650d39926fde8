"""Poses of a ROS 2 system to sonard. `conversions` needs no ROS, `node` is the node."""
