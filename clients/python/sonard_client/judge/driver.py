"""Runs the driver under test as its user would. Measures its processes with /proc. Splits its output into log lines and lines of
the tap: JSON about published pings and the state of the link (docs/judge.md)."""
from __future__ import annotations

import json
import os
import pathlib
import shlex
import signal
import subprocess
import threading
import time
from typing import IO, Dict, List, NamedTuple, Optional, Sequence, Tuple

_LOG_KEPT = 4 << 20    # bytes of a driver's output that are stored
_LONGEST_LINE = 64 << 10
_PAGE, _TICK = os.sysconf("SC_PAGE_SIZE"), os.sysconf("SC_CLK_TCK")


class Published(NamedTuple):
    """A line of the tap for a ping that the driver published."""
    mono: float
    number: Optional[int]
    crc: int
    rows: Optional[int]
    beams: Optional[int]


class State(NamedTuple):
    """A line of the tap for the state of the link: "lost", "ok", ..."""
    mono: float
    state: str


class Sample(NamedTuple):
    """Resources that all of the driver's processes use at one moment."""
    mono: float
    resident_mib: float
    descriptors: int
    cpu_s: float


def tap_line(line: bytes, mono: float) -> "Published | State | None":
    """Parses {"id": 812, "crc32": "0a1b2c3d"}, optionally with rows and beams, or {"state": "lost"}; None for other lines."""
    if not line.startswith(b"{"):
        return None
    try:
        item = json.loads(line)
        if "crc32" in item:
            crc = item["crc32"]
            number = item.get("id")
            crc = int(crc, 16) if isinstance(crc, str) else int(crc)
            sizes = [None if item.get(name) is None else int(item[name]) for name in ("rows", "beams")]
            return Published(mono, None if number is None else int(number), crc & 0xFFFFFFFF, sizes[0], sizes[1])
        if "state" in item:
            return State(mono, str(item["state"]))
    except (ValueError, TypeError, AttributeError):
        pass
    return None


def expand(command: str, ip: str, port: int, device_id: int) -> List[str]:
    """Splits a command line into words and replaces {ip}, {port} and {id} in them."""
    words = shlex.split(command)
    for name, value in (("{ip}", ip), ("{port}", str(port)), ("{id}", str(device_id))):
        words = [word.replace(name, value) for word in words]
    return words


class Driver:
    """The processes of the driver; start() starts them, stop() ends them. tap: whether standard output has lines of the tap."""

    def __init__(self, words: Sequence[str], prefix: Sequence[str], log: pathlib.Path, tap: bool) -> None:
        self._words, self._prefix, self._log_path, self._tap = list(words), list(prefix), log, tap
        self._process: Optional["subprocess.Popen[bytes]"] = None
        self._threads: List[threading.Thread] = []
        self._lock = threading.Lock()
        self._log_bytes = 0
        self.started = time.monotonic()  # start of the case; times in the log count from here
        self.published: List[Published] = []
        self.states: List[State] = []
        self.lines: Dict[int, int] = {}      # number of log lines in each tenth of a second
        self.line_times: List[float] = []    # times of the first 10000 log lines
        self.samples: List[Sample] = []
        self.peak_mib = 0.0
        self.exited: Optional[Tuple[float, int]] = None  # time and exit code

    def start(self) -> None:
        environment = {key: value for key, value in os.environ.items() if not key.startswith("SONARD_LAB")}
        self._process = subprocess.Popen([*self._prefix, *self._words], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                         stderr=subprocess.PIPE, start_new_session=True, env=environment)
        self.exited = None
        for pipe, tap in ((self._process.stdout, self._tap), (self._process.stderr, False)):
            assert pipe is not None
            thread = threading.Thread(target=self._read, args=(pipe, tap), daemon=True)
            thread.start()
            self._threads.append(thread)

    @property
    def pid(self) -> int:
        return self._process.pid if self._process else 0

    def poll(self) -> Optional[int]:
        """Returns the exit code if the driver has ended (negative after a signal). Otherwise adds a Sample and returns None."""
        assert self._process is not None
        code = self._process.poll()
        if code is None:
            self._sample()
        elif self.exited is None:
            self.exited = (time.monotonic(), code)
        return code

    def stop(self) -> None:
        """Ends all processes of the driver with SIGTERM and, after 2 s, SIGKILL."""
        if self._process is None:
            return
        for sign, wait_s in ((signal.SIGTERM, 2.0), (signal.SIGKILL, 5.0)):
            try:
                os.killpg(self._process.pid, sign)
            except ProcessLookupError:
                break
            try:
                self._process.wait(wait_s)
            except subprocess.TimeoutExpired:
                continue
        for thread in self._threads:
            thread.join(1)
        self._threads = []

    def first_line_after(self, mono: float) -> Optional[float]:
        with self._lock:
            return next((t for t in self.line_times if t > mono), None)

    def lines_per_s(self, since: float, window_s: float = 5.0) -> float:
        """Returns the highest rate of log lines in any window after `since`."""
        with self._lock:
            counts = sorted((tenth, count) for tenth, count in self.lines.items() if tenth >= int(since * 10))
        best, first, total = 0, 0, 0
        for tenth, count in counts:
            total += count
            while counts[first][0] <= tenth - window_s * 10:
                total -= counts[first][1]
                first += 1
            best = max(best, total)
        return best / window_s

    # ---- output
    def _read(self, pipe: IO[bytes], tap: bool) -> None:
        rest = b""
        with pipe, open(self._log_path, "ab") as log:
            while True:
                chunk = os.read(pipe.fileno(), 1 << 16)
                now = time.monotonic()
                if not chunk:
                    return
                *lines, rest = (rest + chunk).split(b"\n")
                if len(rest) > _LONGEST_LINE:
                    lines, rest = [*lines, rest], b""
                self._lines(lines, now, tap, log)

    def _lines(self, lines: List[bytes], now: float, tap: bool, log: IO[bytes]) -> None:
        kept = []
        with self._lock:
            for line in lines:
                item = tap_line(line, now) if tap else None
                if isinstance(item, Published):
                    self.published.append(item)
                    continue
                if isinstance(item, State):
                    self.states.append(item)
                elif line.strip():
                    self.lines[int(now * 10)] = self.lines.get(int(now * 10), 0) + 1
                    if len(self.line_times) < 10000:
                        self.line_times.append(now)
                if self._log_bytes < _LOG_KEPT:
                    text = b"%8.3f %s\n" % (now - self.started, line)
                    self._log_bytes += len(text)
                    kept.append(text)
        if kept:
            log.write(b"".join(kept))
            log.flush()              

    # ---- /proc
    def _sample(self) -> None:
        resident, descriptors, cpu = 0.0, 0, 0.0
        for pid in family_of(self.pid):
            try:
                words = pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
                cpu += (int(words[11]) + int(words[12])) / _TICK
                resident += int(words[21]) * _PAGE / (1 << 20)
                descriptors += len(os.listdir(f"/proc/{pid}/fd"))
            except (OSError, ValueError, IndexError):
                continue
        self.peak_mib = max(self.peak_mib, resident)
        self.samples.append(Sample(time.monotonic(), resident, descriptors, cpu))


def family_of(pid: int) -> List[int]:
    """Returns the IDs of a process and of all its descendants."""
    found = [pid]
    for one in found:
        try:
            for task in os.listdir(f"/proc/{one}/task"):
                text = pathlib.Path(f"/proc/{one}/task/{task}/children").read_text(encoding="ascii")
                found.extend(int(child) for child in text.split() if int(child) not in found)
        except OSError:
            continue
    return found
