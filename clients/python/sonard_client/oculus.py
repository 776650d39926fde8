"""Client for Oculus sonars, emulated or real: connects, sends fire messages, receives pings."""
from __future__ import annotations

import errno
import socket
import time
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Callable, Deque, Iterator, List, Optional

from . import layouts
from .endpoints import endpoint
from .layouts import FireSettings
from .ping import Ping, ping_from
from .stream import Message, MessageReader


def _checked(name: str, value: float, low: float, high: float) -> float:
    if not low <= value <= high:  # also rejects NaN
        raise ValueError(f"{name} is {value}: it must be between {low:g} and {high:g}")
    return value


def settings_of(range_m: float, rate_hz: int, gain_percent: float, mode: int, beams: int, bits: int, gains: bool, salinity: float,
                sound_speed: float, gamma: int, gain_assist: bool, triggered: bool) -> FireSettings:
    """Converts settings to the fields of a fire message. Raises ValueError for a value that the sonar does not support."""
    for name, value, choice in (("mode", mode, (1, 2)), ("rate_hz", rate_hz, tuple(layouts.RATE_CODES)),
                                ("beams", beams, (256, 512)), ("bits", bits, (8, 16, 32))):
        if value not in choice:
            raise ValueError(f"{name} is {value}: it must be one of {', '.join(map(str, sorted(choice)))}")
    chosen = ((bits == 16, layouts.WIDE_SAMPLES), (gains, layouts.ROW_GAINS), (gain_assist, layouts.GAIN_ASSIST),
              (beams == 512, layouts.MANY_BEAMS), (triggered, layouts.TRIGGERED))
    flags = layouts.METRES | layouts.SIMPLE_PING | sum(bit for wanted, bit in chosen if wanted)
    extended = (layouts.SAMPLES_32_BIT if bits == 32 else 0,) + (0,) * 8
    return FireSettings(
        mode=mode, rate_code=layouts.RATE_CODES[rate_hz], gamma=int(_checked("gamma", gamma, 0, 255)), flags=flags,
        range=float(_checked("range_m", range_m, 0, 1000)), gain_percent=float(_checked("gain_percent", gain_percent, 0, 100)),
        sound_speed_mps=float(_checked("sound_speed", sound_speed, 0, 2000)),
        salinity_ppt=float(_checked("salinity", salinity, 0, 50)), extended=extended)


class OculusClient:
    """with OculusClient("127.0.0.2") as sonar: sonar.fire(range_m=5); ping = sonar.ping()

    Keep reading: the sonar resets a client that stops reading, and does not store pings for it."""

    def __init__(self, address: str, port: int = layouts.DATA_PORT, timeout: float = 5.0) -> None:
        self.address, self._timeout = endpoint(address, port), timeout
        self.reader = MessageReader()
        self.settings: Optional[FireSettings] = None  # settings of the last request
        self._last_fire = b""
        self._ready: Deque[Message] = deque()
        self._has_received = False
        try:
            self._socket = socket.create_connection(self.address, timeout=timeout)
        except ConnectionRefusedError:
            raise ConnectionRefusedError(
                errno.ECONNREFUSED,
                f"{self.address[0]}:{self.address[1]} refuses the connection: is a sonar running there?") from None
        except socket.timeout:
            raise TimeoutError(errno.ETIMEDOUT, f"{self.address[0]}:{self.address[1]} did not answer within {timeout:g} s") from None
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def fire(self, range_m: float = 10, rate_hz: int = 10, gain_percent: float = 50, mode: int = 2, beams: int = 512,
             bits: int = 8, gains: bool = False, salinity: float = 0, sound_speed: float = 0, gamma: int = 127,
             gain_assist: bool = False, triggered: bool = False, version: int = 2) -> FireSettings:
        """Requests pings with these settings, which apply until the next request.

        rate_hz: maximum, 2, 5, 10, 15 or 40; 0 = standby. mode: 1 low frequency, 2 high. gains: a gain before each row.
        sound_speed: m/s, 0 = the sonar computes it. gamma: exponent of the samples = gamma / 255, 255 = linear.
        triggered: one ping for each again(). version: message version; 2 adds heading, pitch and roll, old drivers use 0."""
        if version not in (0, 1, 2):
            raise ValueError(f"version is {version}: it must be 0, 1 or 2")
        if bits == 32 and version != 2:
            raise ValueError("32-bit samples need version 2")
        self.settings = settings_of(range_m, rate_hz, gain_percent, mode, beams, bits, gains, salinity, sound_speed, gamma,
                                    gain_assist, triggered)
        self._last_fire = layouts.fire_bytes(self.settings, version)
        self._send(self._last_fire)
        return self.settings

    def again(self) -> None:
        """Sends the last fire message again. If it had triggered=True, this triggers one ping."""
        if not self._last_fire:
            raise ValueError("no settings were sent: call fire() first")
        self._send(self._last_fire)

    def standby(self) -> None:
        """Stops the pings until the next fire()."""
        self.fire(rate_hz=0)

    def pings(self, timeout: float = 10.0, count: Optional[int] = None) -> Iterator[Ping]:
        """Yields pings, `count` of them or without limit. Raises TimeoutError after `timeout` seconds without a ping, and
        ConnectionError when the sonar closes the connection."""
        while count is None or count > 0:
            yield self.ping(timeout)
            if count is not None:
                count -= 1

    def ping(self, timeout: float = 10.0) -> Ping:
        """Returns the next ping; errors as with pings()."""
        deadline = time.monotonic() + timeout
        while True:
            message = self.message(deadline - time.monotonic())
            if message is None:
                raise TimeoutError(f"no ping from {self.address[0]} within {timeout:g} s" +
                                   ("" if self._last_fire else ": fire() was not called"))
            if message.type == layouts.PING:
                return ping_from(message)

    def pings_during(self, act: Callable[[], Any], settle: float = 0.1) -> List[Ping]:
        """Runs act() in another thread. Returns the pings received until none arrives for `settle` seconds after act().
        Exceptions of act() are raised here. With clock: lockstep or follow, time waits for readers, so one thread alone would
        deadlock. Example: sonar.pings_during(lambda: control.step(0.5))"""
        pings: List[Ping] = []
        with ThreadPoolExecutor(1) as executor:
            future = executor.submit(act)
            while True:
                was_done = future.done()
                message = self.message(settle)
                if message is not None and message.type == layouts.PING:
                    pings.append(ping_from(message))
                elif message is None and was_done:
                    future.result()
                    return pings

    def message(self, timeout: float = 10.0) -> Optional[Message]:
        """Returns the next message of any type, including dummies; None if none is complete within `timeout` seconds."""
        deadline = time.monotonic() + timeout
        while not self._ready:
            left = deadline - time.monotonic()
            if left <= 0:
                return None
            self._socket.settimeout(left)
            try:
                received = self._socket.recv(1 << 18)
            except socket.timeout:
                return None
            except ConnectionError:  # the sonar closed the connection before it read the request
                received = b""
            if not received:
                raise self._closed()
            self._has_received = True
            self.reader.feed(received)
            self._ready.extend(self.reader)
        return self._ready.popleft()

    def _send(self, data: bytes) -> None:
        try:
            self._socket.settimeout(self._timeout)
            self._socket.sendall(data)
        except ConnectionError:
            raise self._closed() from None

    def _closed(self) -> ConnectionError:
        return ConnectionError(f"{self.address[0]} closed the connection" +
                               ("" if self._has_received else " without sending data: it may already have a client"))

    def close(self) -> None:
        self._socket.close()

    def __enter__(self) -> OculusClient:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()
