"""Installs the package with colcon; see README.md."""
from setuptools import setup

setup(
    name="sonard_bridge",
    version="0.1.0",
    packages=["sonard_bridge"],
    data_files=[("share/ament_index/resource_index/packages", ["resource/sonard_bridge"]),
                ("share/sonard_bridge", ["package.xml"]),
                ("share/sonard_bridge/launch", ["launch/bridge.launch.py", "launch/sonard.launch.py"])],
    install_requires=["setuptools"],
    zip_safe=True,
    description="Poses of a ROS 2 system to sonard, and sonard's data as topics",
    license="Apache-2.0",
    entry_points={"console_scripts": ["bridge = sonard_bridge.node:main"]},
)
