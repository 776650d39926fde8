"""The parameters of the node: one table for the node, the launch files and the tests. It needs no ROS."""
from __future__ import annotations

import math
from typing import Any, Dict, NamedTuple, Tuple, Union

from .conversions import endpoint

JSON_PORT, HTTP_PORT = 14771, 8088
ONE_SOURCE = "set one of the parameters odometry, pose, or tf_parent with tf_child"
Value = Union[str, bool, float]


class BadParameter(ValueError):
    """A parameter has a wrong value. The text names the parameter and the values it accepts."""

    def __init__(self, name: str, why: str) -> None:
        super().__init__(f"parameter {name}: {why}")
        self.name = name


class Parameter(NamedTuple):
    name: str
    default: Value  # a value of its type
    meaning: str


PARAMETERS: Tuple[Parameter, ...] = (
    Parameter("odometry", "", "topic of nav_msgs/Odometry; its twist is sent too (from body axes to world axes)"),
    Parameter("pose", "", "topic of geometry_msgs/PoseStamped"),
    Parameter("tf_parent", "", "world frame of the transform that is the vehicle's pose"),
    Parameter("tf_child", "", "body frame of the transform"),
    Parameter("tf_rate_hz", 50.0, "how often the transform is requested"),
    Parameter("use_stamps", True, "send the messages' stamps; false: the time of receipt counts"),
    Parameter("vehicle", "", "sonard's name of the vehicle; may be empty if there is one"),
    Parameter("sonard", f"127.0.0.1:{JSON_PORT}", "poses.json of sonard"),
    Parameter("http", f"127.0.0.1:{HTTP_PORT}", "control.http of sonard"),
    Parameter("token_file", "", "file with the secret of control.token_file"),
    Parameter("truth", "~/vehicle_pose", "topic of the pose that sonard uses, geometry_msgs/PoseStamped"),
    Parameter("truth_rate_hz", 0.0, "rate of the topic in truth; 0: it is not published"),
    Parameter("tf_static", False, "publish where the sonars are mounted"),
    Parameter("base_frame", "", "frame that the sonars are mounted on; empty: tf_child, else the vehicle's name"),
    Parameter("clouds", False, "publish ~/SONAR/cloud, sensor_msgs/PointCloud2"),
    Parameter("cloud_threshold", 0.35, "threshold of clouds: part of the full scale for samples, of the strongest for returns in space; 0: all"),
    Parameter("scans", False, "publish ~/SONAR/scan, sensor_msgs/LaserScan: the true range of the first hit of each beam"),
    Parameter("clock", False, "publish /clock, of a sonard whose clock is stepped or lockstep"),
)


def value_of(parameter: Parameter, given: Any) -> Value:
    """Converts a value to the parameter's type. Accepts text and integers for numbers, because YAML chooses the type from the
    spelling."""
    kind = type(parameter.default)
    if kind is float and not isinstance(given, bool):
        try:
            number = float(given)
        except (TypeError, ValueError):
            number = math.nan
        if math.isfinite(number):
            return number
    elif isinstance(given, kind):
        return given
    elif kind is str and isinstance(given, int) and not isinstance(given, bool):
        return str(given)
    takes = {str: "text; write it in quotes", bool: "true or false", float: "a number"}[kind]
    raise BadParameter(parameter.name, f"{given!r} is not {takes}")


def checked(given: Dict[str, Any]) -> Dict[str, Any]:
    """Returns the values by name, converted and checked against their bounds. `given` has a value for every parameter."""
    values = {p.name: value_of(p, given[p.name]) for p in PARAMETERS}
    sources = [name for name in ("odometry", "pose", "tf_child") if values[name]]
    if bool(values["tf_parent"]) != bool(values["tf_child"]):
        raise BadParameter("tf_child" if values["tf_parent"] else "tf_parent", "is missing: a transform has two frames")
    if len(sources) > 1:
        raise BadParameter(sources[1], f"{sources[0]} is set too; {ONE_SOURCE}")
    wants_anything = values["truth_rate_hz"] or any(values[name] for name in ("tf_static", "clouds", "scans", "clock"))
    if not sources and not wants_anything:
        raise BadParameter("odometry", "nothing to do; " + ONE_SOURCE)
    for name, lowest, highest, takes in (("tf_rate_hz", 0.01, 1000, "from 0.01 to 1000"),
                                         ("truth_rate_hz", 0, 100, "from 0 to 100"),
                                         ("cloud_threshold", 0, 1, "from 0 to 1")):
        if not lowest <= values[name] <= highest:
            raise BadParameter(name, f"{values[name]:g} is not {takes}")
    for name, port in (("sonard", JSON_PORT), ("http", HTTP_PORT)):
        try:
            values[name] = endpoint(values[name], port)
        except ValueError as error:
            raise BadParameter(name, str(error)) from None
    values["token"] = ""
    if values["token_file"]:
        try:
            with open(values["token_file"], encoding="utf-8") as file:
                values["token"] = file.readline().strip()
        except (OSError, UnicodeDecodeError) as error:
            why = getattr(error, "strerror", None) or error
            raise BadParameter("token_file", f"cannot read {values['token_file']}: {why}") from None
        if not values["token"]:
            raise BadParameter("token_file", f"{values['token_file']} has no secret in its first line")
    return values
