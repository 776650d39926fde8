"""A running case: sonard, the driver, and their observers (packet capture, tap, journal of faults)."""
from __future__ import annotations

import contextlib
import dataclasses
import http.client
import json
import pathlib
import threading
import time
from typing import Any, Callable, Dict, List, Optional, Tuple

from .. import lab
from ..control import Control, ControlError
from ..daemon import Daemon
from .driver import Driver, Published
from .makes import make_of
from .truth import Make
from .verdicts import sort_published
from .wire import Capture

_STEP_S = 0.05
_MOST_MIB = 6144.0  # a driver that uses more memory is stopped before the computer runs out of it


class StatusWire(threading.Thread):
    """Replaces the capture if packets may not be read: requests sonard's counts of its clients five times a second."""

    def __init__(self, control: Control) -> None:
        super().__init__(daemon=True)
        self._control, self._stopping = control, threading.Event()
        self.connections: List[Tuple[float, Optional[float], str]] = []
        self.ping_times: List[float] = []
        self._open: Dict[str, Tuple[int, int]] = {}  # address: (number of connection, pings written)

    def run(self) -> None:
        while not self._stopping.wait(0.2):
            try:
                sonars = self._control.status()["sonars"]
            except (OSError, ValueError, KeyError, http.client.HTTPException):
                continue
            now, clients = time.monotonic(), {c["address"]: c for sonar in sonars for c in sonar.get("clients", ())}
            for address in [a for a in self._open if a not in clients]:
                number = self._open.pop(address)[0]
                self.connections[number] = (self.connections[number][0], now, "gone")
            for address, client in clients.items():
                if address not in self._open:
                    self.connections.append((now, None, ""))
                    self._open[address] = len(self.connections) - 1, 0
                number, before = self._open[address]
                written = int(client.get("pings_written", 0))
                self.ping_times.extend([now] * (written - before))
                self._open[address] = number, written

    def end_faults(self) -> None:
        with contextlib.suppress(OSError, ControlError, http.client.HTTPException):
            self._control.reset_faults()

    def stop(self) -> None:
        self._stopping.set()
        self.join(2)


class Journal:
    """Reads the journal of faults, a file to which sonard appends records."""

    def __init__(self, path: pathlib.Path) -> None:
        self._path, self._at, self._rest = path, 0, b""
        self.records: List[Dict[str, Any]] = []

    def read(self) -> None:
        try:
            with open(self._path, "rb") as file:
                file.seek(self._at)
                text = file.read()
        except FileNotFoundError:
            return
        self._at += len(text)
        *lines, self._rest = (self._rest + text).split(b"\n")
        for line in lines:
            try:
                self.records.append(json.loads(line))
            except ValueError:
                continue

    def first(self) -> Optional[float]:
        return next((mono(r) for r in self.records if r.get("event") in ("began", "injected")), None)

    def ended(self, times: int) -> Optional[float]:
        """Returns when the fault ended for the `times`-th time, or None."""
        found = [mono(r) for r in self.records if r.get("event") == "ended"]
        return found[times - 1] if len(found) >= times else None

    def last(self) -> Optional[float]:
        return mono(self.records[-1]) if self.records else None


def mono(record: Dict[str, Any]) -> float:
    return int(record["mono_ns"]) / 1e9


@dataclasses.dataclass
class Scene:
    """The programs, observers and files of a running case. Times are monotonic seconds."""
    spec: Dict[str, Any]
    folder: pathlib.Path
    address: str
    sonard: Daemon
    driver: Driver
    capture: Optional[Capture]
    status: StatusWire
    journal: Journal
    laboratory: Optional[lab.Lab]
    started: float
    moments: List[Tuple[float, str]]

    @property
    def tapped(self) -> bool:
        return bool(self.spec["tap"] != "none")

    @property
    def make(self) -> Optional[Make]:
        return make_of(self.spec["profile"])

    @property
    def reads_pings(self) -> bool:
        """True if the truth can be read from the wire: there is a capture, and a reader of the make's protocol."""
        return self.capture is not None and self.make is not None

    def say(self, what: str) -> None:
        self.moments.append((time.monotonic(), what))

    def good(self) -> List[Published]:
        if self.capture is None or not self.reads_pings:
            return list(self.driver.published)
        return sort_published(list(self.driver.published), self.capture.seen())[0]

    def ping_times(self) -> List[float]:
        """Returns the times at which the driver got pings: when it published them or, without a tap, acknowledged them."""
        if self.tapped:
            return [p.mono for p in self.good()]
        if self.capture is not None and self.reads_pings:
            return [s.mono for s in self.capture.delivered()]
        return list(self.status.ping_times)

    def moves(self) -> Tuple[int, ...]:
        """Returns counts. Any activity between sonar and driver increases at least one of them."""
        wire = self.capture
        return (len(self.status.ping_times), len(self.driver.published), len(self.driver.line_times),
                len(wire.seen()) if wire else 0, len(wire.connections) if wire else len(self.status.connections),
                sum(len(c.fires) for c in wire.connections) if wire else 0)

    def wait(self, until: Callable[[], bool], timeout_s: float, moves: Optional[Callable[[], object]] = None) -> bool:
        """Waits for a condition and returns whether it holds. Returns early if the driver or sonard ends or the driver takes too
        much memory. Each change of moves() restarts the time-out, up to six times `timeout_s` in all, so that a slow computer does not look
        like an idle driver."""
        began = time.monotonic()
        deadline, before = began + timeout_s, moves() if moves else None
        while True:
            looked = time.monotonic()  # before moves(), so that activity during a stall of this computer counts
            if moves and (now := moves()) != before:
                before, deadline = now, min(began + 6 * timeout_s, looked + timeout_s)
            self.journal.read()
            if until():
                return True
            if looked >= deadline:
                return False
            if self.driver.poll() is not None or self.sonard.ended():
                return until()
            if self.driver.samples and self.driver.samples[-1].resident_mib > _MOST_MIB:
                self.say(f"stopped: {self.driver.samples[-1].resident_mib:.0f} MiB resident")
                self.driver.stop()
                self.driver.poll()
                return False
            time.sleep(_STEP_S)
