"""Makes the result of a case, which is written to case.json, with its time line."""
from __future__ import annotations

import itertools
from typing import Any, Dict, List, Sequence, Tuple

from .cases import Case
from .scene import Scene, mono
from .verdicts import Observation, Verdict, back_at, colour
from .wire import Connection, hex_around


def result_of(scene: Scene, case: Case, seen: Observation, verdict: Verdict) -> Dict[str, Any]:
    """Returns the content of case.json. `wall_clock` has the values that depend on time; other values are equal in equal runs."""
    comment = f"sonard judge, case {case.number} {case.name}: {case.sentence}"
    capture_packets = scene.capture.write_pcapng(scene.folder / "case.pcapng", comment) if scene.capture else 0
    connections: List[Connection] = scene.capture.connections if scene.capture else []
    data, recovery = verdict.words()
    samples = seen.samples
    return {
        "ran": True, "data": verdict.data, "recovery": verdict.recovery, "must_holds": verdict.must_holds,
        "should_holds": verdict.should_holds, "colour": colour(verdict), "tapped": scene.tapped and seen.truth_known,
        "wall_clock": {
            "data": data, "recovery": recovery, "must": verdict.must, "should": verdict.should,
            "first_false": verdict.first_false,
            "began_s": round(seen.began - scene.started, 3), "ended_s": round(seen.ended - scene.started, 3),
            "watched_s": round(seen.watched_until - scene.started, 3), "pings_on_wire": len(seen.true_pings),
            "pings_acknowledged": len(seen.delivered), "pings_published": len(seen.published),
            "process": {"ending": "alive" if seen.exit_code is None else seen.exit_code,
                        "peak_mib": round(scene.driver.peak_mib, 1),
                        "cpu_s": round(samples[-1].cpu_s, 2) if samples else 0, "log_lines_s": round(seen.log_lines_s, 1),
                        "descriptors": [samples[0].descriptors, samples[-1].descriptors] if samples else []},
            "connections": [{"from": c.peer, "opened_s": round(c.opened - scene.started, 3), "bytes": c.acked,
                             "settings": len(c.fires),
                             "zero_windows": c.zero_windows, "ended_by": c.ended_by if _over(c, seen) else "",
                             "ended_s": round((c.ended or 0) - scene.started, 3) if _over(c, seen) else None}
                            for c in connections],
            "timeline": timeline(scene, seen, connections), "journal": scene.journal.records[:2000],
            "hex": _hex(scene, connections), "packets": capture_packets,
            "packets_missed": scene.capture.lost_packets if scene.capture else 0,
            "capture": "" if capture_packets else "no capture: reading packets needs namespaces or root",
        },
    }


def _over(connection: Connection, seen: Observation) -> bool:
    return connection.ended is not None and connection.ended <= seen.watched_until


def timeline(scene: Scene, seen: Observation, connections: List[Connection]) -> List[Tuple[float, str]]:
    moments = list(scene.moments)
    for c in connections:
        moments.append((c.opened, f"connection {c.number} opens" if c.established else f"connection {c.number} is tried"))
        moments.extend((t, f"settings sent on connection {c.number}") for t in c.fires[:3])
        if c.ended is not None and c.ended <= seen.watched_until:
            moments.append((c.ended, f"connection {c.number} ends: {c.ended_by}"))
    for record, more in in_brief(scene.journal.records):
        moments.append((mono(record), f"fault {record.get('kind', '')} {record.get('event', '')}" +
                        (f", ping {record['ping']}" if record.get("ping") else "") + more))
    if seen.published:
        moments.append((seen.published[0].mono, f"first ping published: {seen.published[0].number}"))
    times = scene.ping_times()
    back = back_at(times, seen.ended)
    if back is not None and seen.exit_code is None:
        moments.append((back, "pings again"))
    if seen.exit_time is not None:
        moments.append((seen.exit_time, f"driver ended with {seen.exit_code}"))
    return [(round(t - scene.started, 3), what) for t, what in sorted(moments)][:200]


def in_brief(records: Sequence[Dict[str, Any]]) -> List[Tuple[Dict[str, Any], str]]:
    """Shortens the journal: keeps the first of consecutive records that differ only in the ping, and counts the others."""
    def alike(record: Dict[str, Any]) -> Tuple[Any, ...]:
        return tuple(str(record.get(key)) for key in ("event", "fault", "kind", "sonar", "client"))
    found: List[Tuple[Dict[str, Any], str]] = []
    for _, series in itertools.groupby(records, alike):
        same = list(series)
        found.append((same[0], f", and {len(same) - 1} more, the last of ping {same[-1].get('ping', '')}" if len(same) > 1 else ""))
    return found


def _hex(scene: Scene, connections: List[Connection]) -> List[str]:
    """Returns lines of hex around the first byte that the fault changed."""
    for record in scene.journal.records:
        offset = int(record.get("offset", -1))
        connection = next((c for c in connections if c.peer == record.get("client")), None)
        if offset >= 0 and connection is not None and offset < len(connection.stream):
            return hex_around(bytes(connection.stream[:offset + 128]), offset)
    return []
