"""Derives the two verdicts of a case from its observations. The functions are pure: no clock, no processes."""
from __future__ import annotations

import collections
import dataclasses
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

from .driver import Published, Sample
from .wire import Seen

BACK_PINGS = 3          # a driver has recovered after this many consecutive pings
SHOULD = {"notice_s": 2.0, "recover_s": 3.0, "lost": 1.0, "rss_mib": 32.0, "log_lines_s": 10.0}
WORDS = {"notice_s": "notices within {:g} s", "recover_s": "is back within {:g} s of the fault's end",
         "lost": "loses at most {:g} more ping", "rss_mib": "takes at most {:g} MiB more memory",
         "log_lines_s": "writes at most {:g} log lines a second", "descriptors": "leaves at most {:g} more descriptors open"}


@dataclasses.dataclass
class Observation:
    """Observations of the capture, the tap and the journal in one run of a case. Times are monotonic seconds."""
    began: float
    ended: float                  # end of the fault
    watched_until: float
    tapped: bool                  # whether there is a tap
    published: Sequence[Published] = ()
    true_pings: Sequence[Seen] = ()      # on the wire
    delivered: Sequence[Seen] = ()       # the pings whose bytes the driver's computer acknowledged
    wire_times: Sequence[float] = ()     # replaces `delivered` if the packets cannot be read
    touched: Sequence[int] = ()          # numbers of the pings that the fault touched
    connections: Sequence[Tuple[float, Optional[float], str]] = ()  # opened, ended, by whom
    log_times: Sequence[float] = ()
    state_times: Sequence[float] = ()
    log_lines_s: float = 0.0
    samples: Sequence[Sample] = ()
    exit_code: Optional[int] = None      # None: the driver was still running
    exit_time: Optional[float] = None
    restarted_well: Optional[bool] = None  # whether pings came after the judge started the driver again
    packets_lost: int = 0                # packets that the capture missed
    truth_known: bool = True             # whether the packets could be read


@dataclasses.dataclass
class Verdict:
    data: str = "CLEAN"           # CLEAN, LOST, STALE, FALSE, UNSEEN
    data_count: int = 0
    recovery: str = "NONE NEEDED"  # NONE NEEDED, BACK, OPERATOR, NEVER, CRASH
    recovery_s: float = 0.0
    must: List[Dict[str, Any]] = dataclasses.field(default_factory=list)    # {"what", "holds", "value"}
    should: List[Dict[str, Any]] = dataclasses.field(default_factory=list)
    first_false: Optional[Dict[str, Any]] = None

    @property
    def must_holds(self) -> bool:
        return all(check["holds"] for check in self.must)

    @property
    def should_holds(self) -> bool:
        return all(check["holds"] for check in self.should)

    def classes(self) -> Tuple[str, str, bool, bool]:
        """Returns the part of a verdict that must be equal in all runs of a case. Figures are left out, because they vary."""
        return self.data, self.recovery, self.must_holds, self.should_holds

    def words(self) -> Tuple[str, str]:
        data = f"{self.data} {self.data_count}" if self.data in ("LOST", "STALE", "FALSE") else self.data
        return data, f"{self.recovery_s:.1f} s" if self.recovery == "BACK" else self.recovery


def _matches(shown: Published, seen: Seen) -> bool:
    ping = seen.ping
    return (shown.crc in ping.crcs and shown.number in (None, ping.number) and shown.rows in (None, ping.rows) and
            shown.beams in (None, ping.beams))


def sort_published(published: Sequence[Published], true_pings: Sequence[Seen]
                   ) -> Tuple[List[Published], List[Published], List[Published]]:
    """Sorts published pings into (good, stale, false). A stale ping was published before; the sonar never sent a false one."""
    by_crc: Dict[int, List[Seen]] = {}
    for seen in true_pings:
        for crc in seen.ping.crcs:
            by_crc.setdefault(crc, []).append(seen)
    # After a reboot the sonar sends the same numbers and images again, on another connection. They count as new pings.
    connections: Dict[Tuple[int, int], "set[int]"] = {}
    for seen in true_pings:
        for crc in seen.ping.crcs:
            connections.setdefault((seen.ping.number, crc), set()).add(seen.connection)
    good: List[Published] = []
    stale: List[Published] = []
    false: List[Published] = []
    before: "collections.Counter[Tuple[int, int]]" = collections.Counter()
    for shown in published:
        matching = [seen for seen in by_crc.get(shown.crc, ()) if _matches(shown, seen)]
        if not matching:
            false.append(shown)
            continue
        # Equal images without a number cannot be distinguished; the first one that is not yet published is assumed.
        keys = [(seen.ping.number, shown.crc) for seen in matching]
        fresh = next((key for key in keys if before[key] < len(connections[key])), None)
        if fresh is None:
            stale.append(shown)
        else:
            before[fresh] += 1
            good.append(shown)
    return good, stale, false


def back_at(times: Sequence[float], after: float, pings: int = BACK_PINGS, within_s: float = 3.0) -> Optional[float]:
    """Returns the time of the first of `pings` events that follow `after` and lie within `within_s` of each other, or None."""
    later = [t for t in times if t >= after]
    for first, last in zip(later, later[pings - 1:]):
        if last - first <= within_s:
            return first
    return None


def longest_gap(times: Sequence[float], since: float, until: float) -> float:
    inside = [since, *(t for t in times if since <= t <= until), until]
    return max(b - a for a, b in zip(inside, inside[1:]))


def judge(seen: Observation, must: Mapping[str, float], should: Mapping[str, Optional[float]], wants_notice: bool) -> Verdict:
    """Makes the verdict. must: limits of this case in addition to those of all cases (the driver survives, publishes nothing false,
    comes back). should: limits that replace those of SHOULD; None removes one."""
    verdict = Verdict()
    good, stale, false = sort_published(seen.published, seen.true_pings) if seen.tapped and seen.truth_known else (
        list(seen.published), [], [])
    times = [p.mono for p in good] if seen.tapped else list(seen.wire_times) or [s.mono for s in seen.delivered]
    lost = _judge_data(verdict, seen, good, stale, false)
    _judge_recovery(verdict, seen, times, sent_later(good, seen.true_pings, seen.connections, seen.began, seen.ended)
                    if seen.tapped and seen.truth_known else times)

    alive = verdict.recovery != "CRASH"
    back = verdict.recovery in ("NONE NEEDED", "BACK")
    verdict.must.append({"what": "survives", "holds": alive, "value": _ending(seen)})
    if seen.tapped and seen.truth_known:
        verdict.must.append({"what": "publishes nothing false", "holds": not false, "value": f"{len(false)} false"})
        verdict.must.append({"what": "publishes nothing twice as new", "holds": not stale, "value": f"{len(stale)} repeated"})
    verdict.must.append({"what": "comes back by itself", "holds": back, "value": verdict.words()[1]})

    limits: Dict[str, Optional[float]] = {**SHOULD, **should}
    measured = _figures(seen, lost, verdict if back else None)
    for name, limit in must.items():
        _check(verdict.must, name, limit, measured.get(name))
    for name, wanted in limits.items():
        if wanted is None or name in must or (name == "notice_s" and not wants_notice) or (name == "lost" and not seen.tapped):
            continue
        if name == "rss_mib" and name not in measured:  # the driver ended before its memory was measured under the fault
            continue
        _check(verdict.should, name, wanted, measured.get(name))
    return verdict


def _check(checks: List[Dict[str, Any]], name: str, limit: float, value: Optional[float]) -> None:
    checks.append({"what": WORDS[name].format(limit), "holds": value is not None and value <= limit,
                   "value": "never" if value is None else round(value, 2)})


def _ending(seen: Observation) -> str:
    if seen.exit_code is None:
        return "alive"
    return f"exit code {seen.exit_code}" if seen.exit_code >= 0 else f"signal {-seen.exit_code}"


def _judge_data(verdict: Verdict, seen: Observation, good: Sequence[Published], stale: Sequence[Published],
                false: Sequence[Published]) -> int:
    """Sets the data verdict. Returns the number of lost pings that the fault did not touch."""
    if not seen.tapped or not seen.truth_known:
        verdict.data = "UNSEEN"
        return 0
    shown = {(p.number, p.crc) for p in good}
    crcs_without_number = {p.crc for p in good if p.number is None}
    touched, settle = set(seen.touched), seen.watched_until - 0.5
    until = min(settle, seen.exit_time) if seen.exit_time is not None else settle
    lost = 0
    for one in seen.delivered:
        ping = one.ping
        if ping.needed and seen.began <= one.mono <= until and ping.number not in touched and not crcs_without_number & ping.crcs and \
                not any((ping.number, crc) in shown for crc in ping.crcs):
            lost += 1
    if false:
        verdict.data, verdict.data_count = "FALSE", len(false)
        verdict.first_false = {"mono": false[0].mono, "id": false[0].number, "crc32": f"{false[0].crc:08x}"}
    elif stale:
        verdict.data, verdict.data_count = "STALE", len(stale)
    elif lost:
        verdict.data, verdict.data_count = "LOST", lost
    return lost


def sent_later(good: Sequence[Published], true_pings: Sequence[Seen], connections: Sequence[Tuple[float, Optional[float], str]],
               began: float, ended: float) -> List[float]:
    """Returns the times at which pings were published that the sonar sent after the fault [began, ended]. A slow driver still
    publishes earlier ones then, and a connection that the sonar closed still carries earlier ones; both show no recovery."""
    closed = {number for number, (opened, _, by) in enumerate(connections, 1) if opened <= began and by.startswith("device")}
    later = {(number, crc) for s in true_pings if s.mono >= ended and s.connection not in closed
             for crc in s.ping.crcs for number in (None, s.ping.number)}
    return [p.mono for p in good if (p.number, p.crc) in later]


def _judge_recovery(verdict: Verdict, seen: Observation, times: Sequence[float], later: Sequence[float]) -> None:
    """times: when pings were published. later: the times of those that the sonar sent after the fault."""
    if seen.exit_code is not None and seen.exit_code != 0:
        verdict.recovery = "CRASH"
        return
    back = back_at(later, seen.ended) if seen.exit_code is None else None
    if back is None:
        verdict.recovery = "OPERATOR" if seen.restarted_well else "NEVER"
        return
    verdict.recovery_s = max(0.0, back - seen.ended)
    reconnected = any(opened > seen.began for opened, _, _ in seen.connections)
    before = [t for t in times if t < seen.began]
    period = (before[-1] - before[0]) / (len(before) - 1) if len(before) > 2 else 0.1
    if reconnected or longest_gap(times, seen.began, max(back, seen.ended)) > max(0.5, 4 * period):
        verdict.recovery = "BACK"


def _figures(seen: Observation, lost: int, back: Optional[Verdict]) -> Dict[str, float]:
    figures = {"lost": float(lost), "log_lines_s": seen.log_lines_s}
    if back is not None:
        figures["recover_s"] = back.recovery_s
    noticed = [t for t in (*seen.log_times, *seen.state_times, *(c[0] for c in seen.connections),
                           *(c[1] for c in seen.connections if c[1] is not None and c[2].startswith("driver"))) if t > seen.began]
    if noticed:
        figures["notice_s"] = min(noticed) - seen.began
    before = [s for s in seen.samples if s.mono <= seen.began]
    after = [s for s in seen.samples if s.mono > seen.began]
    if before and after:
        figures["rss_mib"] = max(0.0, max(s.resident_mib for s in after) - before[-1].resident_mib)
        figures["descriptors"] = float(max(0, after[-1].descriptors - before[-1].descriptors))
    elif after:
        figures["rss_mib"] = max(s.resident_mib for s in after) - after[0].resident_mib
        figures["descriptors"] = float(max(0, after[-1].descriptors - min(s.descriptors for s in after)))
    return figures


def colour(verdict: Verdict) -> str:
    """Returns the worse of the two verdicts as good, fair, bad or worst."""
    if verdict.recovery == "CRASH" or verdict.data == "FALSE":
        return "worst"
    if verdict.recovery in ("NEVER", "OPERATOR") or verdict.data == "STALE" or not verdict.must_holds:
        return "bad"
    return "good" if verdict.should_holds else "fair"
