"""A fault that lasts for a `with` block, and the reactions of the sonar's clients to it (docs/faults.md)."""
from __future__ import annotations

import itertools
import os
import threading
import time
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Tuple

if TYPE_CHECKING:
    from .control import Control, Events

Json = Dict[str, Any]
_BY_FAULT = "a fault"  # the reason that the daemon states when a fault ended a connection
_numbers = itertools.count(1)


class Fault:
    """with control.fault("L05", seconds=6) as fault: ...       The fault ends with the block."""

    def __init__(self, control: Control, what: str, record: Json) -> None:
        self._control, self._what, self._record = control, what, dict(record)
        self.name: str = self._record.pop("name", "") or f"{what.lower()}-{os.getpid()}-{next(_numbers)}"
        self._events: Optional[Events] = None
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._seen: List[Tuple[float, Json]] = []  # time of receipt and event
        self._news = threading.Condition()

    def __enter__(self) -> Fault:
        self._events = self._control.events(clients=True, faults=True)  # subscribed before the fault begins, so that no event is missed
        self._thread.start()
        try:
            self._control.add_fault(self._what, name=self.name, **self._record)
        except BaseException:
            self._stop_reading()
            raise
        return self

    def __exit__(self, *_: Any) -> None:
        try:
            if any(fault["state"] != "over" for fault in self.status()):
                self._control.end_fault(self.name)
        finally:
            self._stop_reading()

    def status(self) -> List[Json]:
        """Returns the entries of sonard's list: one for each sonar, and for a trouble one for each of its kinds."""
        return [fault for fault in self._control.faults() if self._is_ours(fault["name"])]

    def injections(self) -> int:
        """Returns how often the fault has acted so far."""
        return sum(fault["injections"] for fault in self.status())

    def journal(self) -> List[Json]:
        """Returns the entries of this fault among the latest 1000 of the journal."""
        return [entry for entry in self._control.fault_journal() if self._is_ours(entry["fault"])]

    def noticed_within(self, seconds: float) -> bool:
        """True if a client of an affected sonar closed its connection, or connected, within `seconds` after the first
        injection (after the beginning, for a fault without injections). Waits at most `seconds` for the first injection, then at
        most `seconds` for the client. A connection that the fault itself ended does not count. A request on an open connection
        is not detected."""
        give_up = time.monotonic() + seconds
        with self._news:
            while True:
                began, sonars = self._beginning()
                limit = give_up if began is None else began + seconds
                if began is not None and any(began <= at <= limit and self._is_notice(event, sonars) for at, event in self._seen):
                    return True
                left = limit - time.monotonic()
                if left <= 0:
                    return False
                self._news.wait(left)

    def _beginning(self) -> Tuple[Optional[float], "set[str]"]:
        entries = [(at, event["fault"]) for at, event in self._seen if "fault" in event and self._is_ours(event["fault"]["fault"])]
        times = [[at for at, entry in entries if entry["event"] == what] for what in ("injected", "began")]
        first = next((found[0] for found in times if found), None)
        return first, {entry["sonar"] for _, entry in entries}

    @staticmethod
    def _is_notice(event: Json, sonars: "set[str]") -> bool:
        client = event.get("client")
        return client is not None and client["sonar"] in sonars and (client["connected"] or client["why"] != _BY_FAULT)

    def _is_ours(self, name: str) -> bool:
        return name == self.name or name.startswith(self.name + ".")  # the kinds of a trouble are NAME.1, NAME.2, ...

    def _read(self) -> None:
        assert self._events is not None
        for event in self._events:
            with self._news:
                self._seen.append((time.monotonic(), event))
                self._news.notify_all()

    def _stop_reading(self) -> None:
        if self._events is not None:
            self._events.interrupt()
            self._thread.join()
            self._events.close()
