"""Sends poses to sonard, receives pings and controls a running daemon. It needs only the standard library, and uses numpy
if installed.

    from sonard_client import OculusClient, PoseSender, Control, Daemon, discover
"""
from .control import Control, ControlError, Events
from .daemon import Daemon, DaemonFailed
from .faults import Fault
from .layouts import FireSettings
from .oculus import OculusClient
from .ping import Peak, Ping
from .poses import PoseSender
from .status import SonarFound, discover
from .stream import Message, MessageReader

__version__ = "0.1.0"
DEFAULT_PROFILE = "oculus-m1200d"  # product in the configurations that these programs make
__all__ = ["Control", "ControlError", "Daemon", "DaemonFailed", "Events", "Fault", "FireSettings", "Message", "MessageReader",
           "OculusClient", "Peak", "Ping", "PoseSender", "SonarFound", "discover"]
