"""pytest: the fixture `sonard`, a daemon with armed faults for one test. It is installed with the package (entry point pytest11).

    def test_my_driver(sonard):
        with start_my_driver(sonard.address), sonard.control.fault("silent-open", seconds=6) as fault:
            assert fault.noticed_within(2)

The daemon runs the configuration that the mark sonard("FILE") names, else that of the ini option sonard_config, else the demo.
Other daemons may run too (`sonard --offset`). The program is the environment variable SONARD, else sonard in the PATH.
"""
from __future__ import annotations

import os
import random
import re
from typing import Any, Iterator

import pytest

from .control import Control
from .daemon import ADDRESS_IN_USE, Daemon, DaemonFailed

_HTTP = re.compile(r"^control .*\bhttp http://([\d.]+):(\d+)", re.M)  # a line of the banner


class RunningSonard:
    """A running sonard. `address` is that of the first sonar, `addresses` are those of all sonars by name."""

    def __init__(self, daemon: Daemon) -> None:
        self.daemon = daemon
        found = _HTTP.search(daemon.log())
        if found is None:
            raise DaemonFailed(f"control.http is off: faults need it\n{daemon.log()}")
        self.control = Control(found[1], int(found[2]))
        self.addresses = {sonar["name"]: sonar["listens"].rpartition(":")[0] for sonar in self.control.status()["sonars"]}
        self.address = next(iter(self.addresses.values()))


def pytest_addoption(parser: Any) -> None:
    parser.addini("sonard_config", "configuration of the fixture sonard (default: the demo)", default="")


def pytest_configure(config: Any) -> None:
    config.addinivalue_line("markers", "sonard(file): configuration of the fixture sonard")


@pytest.fixture
def sonard(request: Any) -> Iterator[RunningSonard]:
    mark = request.node.get_closest_marker("sonard")
    file = mark.args[0] if mark else request.config.getini("sonard_config")
    for offset in random.sample(range(1, 100), 5):
        daemon = Daemon(file or None, os.environ.get("SONARD", "sonard"), ["--faults", "--offset", offset])
        try:
            daemon.__enter__()
        except DaemonFailed as failed:
            if failed.code == ADDRESS_IN_USE:
                continue
            raise
        try:
            yield RunningSonard(daemon)
        finally:
            daemon.__exit__()
        return
    raise DaemonFailed("five offsets are in use")
