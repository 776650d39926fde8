"""Runs one case with a new sonard, a new driver and one fault. The judge starts this program in a network namespace of its own.

    python3 -m sonard_client.judge.run_case FOLDER      reads FOLDER/spec.json, writes FOLDER/case.json
"""
from __future__ import annotations

import bisect
import http.client
import json
import pathlib
import signal
import sys
import time
from typing import Any, Dict, List, Optional, Sequence, Tuple

from .. import lab
from ..control import Control
from ..daemon import Daemon, DaemonFailed
from .cases import Case
from .driver import Driver, expand
from .makes import make_of
from .outcome import result_of
from .scene import Journal, Scene, StatusWire, mono
from .verdicts import BACK_PINGS, Observation, back_at, judge, sent_later
from .wire import Capture, DatagramFlow, Seen

NOMINAL_PINGS, NOMINAL_S = 20, 20.0  # without a fault, a working driver gets this many pings in this time
_SETTLE_S = 0.52
_STILL_S = 20.0          # after this time without any activity the judge stops waiting for the fault
_EARLY_S = 0.02          # the journal's entry may be this much later than its ping
_DEVICE_ID = 7001


def case_from(spec: Dict[str, Any]) -> Case:
    return Case(**spec["case"])


def fault_record(case: Case, ping_bytes: int) -> Dict[str, Any]:
    """Returns the fault record for sonard. A position in bytes becomes a fraction of the message, which sonard expects."""
    record = case.record()
    given = record["with"]
    if "byte" in given:
        given["fraction"] = f"{min(1.0, (int(given.pop('byte')) + 0.2) / max(1, ping_bytes)):.9f}"
    return record


def config_of(spec: Dict[str, Any], case: Optional[Case], address: str, journal: pathlib.Path) -> str:
    # The sonar closes a connection whose client has not acknowledged data for 3 s, as devices do. A driver must connect again.
    more: Dict[str, Any] = {"world": {"scene": "tank-rod.yaml", "seed": spec["seed"]}, "limits": {"dead_peer_s": 3}}
    if spec["fault_engine"]:
        by_sonard = case is not None and case.kind != "N00" and not case.needs_lab
        plan = [fault_record(case, int(spec["ping_bytes"]))] if case is not None and by_sonard else []
        more["faults"] = {"armed": True, "journal": str(journal), "plan": plan}
    make = make_of(spec["profile"])
    options = {"options": spec["options"]} if spec.get("options") else {}
    return lab.lab_config(spec["profile"], address, more, {**(make.sonar if make else {}), **options})


def run(folder: pathlib.Path) -> Dict[str, Any]:
    spec = json.loads((folder / "spec.json").read_text(encoding="utf-8"))
    if spec["space"] == "lab":
        with lab.Lab() as laboratory:
            return _with_sonard(spec, folder, laboratory)
    return _with_sonard(spec, folder, None)


def _with_sonard(spec: Dict[str, Any], folder: pathlib.Path, laboratory: Optional[lab.Lab]) -> Dict[str, Any]:
    offset = 0 if laboratory else int(spec["offset"])
    case = case_from(spec) if spec.get("case") else None
    address = lab.DEVICE if laboratory else f"127.0.{offset}.2"
    config = config_of(spec, case, lab.DEVICE if laboratory else "127.0.0.2", folder / "journal.jsonl")
    sonard = Daemon(config, spec["sonard"], [] if laboratory else ["--offset", str(offset)])
    try:
        with sonard:
            try:
                result = _with_driver(spec, case, folder, laboratory, sonard, address, 8088 + 10 * offset)
            except (OSError, ValueError, http.client.HTTPException):
                if not sonard.ended():
                    raise
                result = {}
            # Without a sonar the driver cannot be judged.
            how, log = sonard.ended(), sonard.log()
            if how:
                result = {"ran": False, "why": f"sonard ended during the case, {how}: {_last_line(log)}", "text": log[-4000:]}
            else:
                sonard.stop()
            (folder / "sonard.log").write_text(sonard.log(), encoding="utf-8")
            return result
    except DaemonFailed as why:
        return {"ran": False, "why": f"sonard refused: {_last_line(str(why))}", "text": str(why)[-4000:]}


def _last_line(text: str) -> str:
    return ([line for line in text.splitlines() if line.strip()] or [""])[-1].strip()[:300]


def port_of(sonar: Dict[str, Any]) -> int:
    """Returns the port in the sonar's status to which a driver connects."""
    for_drivers = [a["address"] for a in sonar.get("addresses", ()) if not a.get("sonar_speaks_first")]
    return int([*for_drivers, sonar["listens"]][0].rpartition(":")[2])


def tcp_ports_of(sonar: Dict[str, Any]) -> List[int]:
    return [int(a["address"].rpartition(":")[2]) for a in sonar.get("addresses", ()) if a.get("protocol") == "tcp"]


def _with_driver(spec: Dict[str, Any], case: Optional[Case], folder: pathlib.Path, laboratory: Optional[lab.Lab], sonard: Daemon,
                 address: str, http_port: int) -> Dict[str, Any]:
    (folder / "driver.log").write_bytes(b"")
    control = Control("127.0.0.1", http_port, timeout=2)
    sonar = control.status()["sonars"][0]
    port = port_of(sonar)
    words = expand(spec["driver"], address, port, _DEVICE_ID)
    driver = Driver(words, laboratory.host if laboratory else [], folder / "driver.log", spec["tap"] == "json")
    try:
        capture: Optional[Capture] = Capture(lab.LINK if laboratory else "lo", address, port, make_of(spec["profile"]),
                                             tcp_ports_of(sonar))
    except (PermissionError, OSError):
        capture = None
    scene = Scene(spec, folder, address, sonard, driver, capture, StatusWire(control), Journal(folder / "journal.jsonl"),
                  laboratory, driver.started, [])
    if capture:
        capture.start()
    scene.status.start()
    try:
        return _nominal(scene, control) if case is None else _case(scene, case)
    except FileNotFoundError as why:
        return {"ran": False, "why": f"the driver does not start: {why.strerror}: {why.filename}"}
    finally:
        driver.stop()
        scene.status.stop()
        if capture and capture.is_alive():
            capture.stop()


# ---- the driver without a fault
def _nominal(scene: Scene, control: Control) -> Dict[str, Any]:
    scene.driver.start()

    def consecutive() -> int:
        numbers = [p.number for p in scene.good()] if scene.tapped else []
        if not scene.tapped or any(n is None for n in numbers):
            return len(scene.ping_times())
        best = run_length = 0
        for before, number in zip([None, *numbers], numbers):
            run_length = run_length + 1 if before is not None and number == before + 1 else 1
            best = max(best, run_length)
        return best

    works = scene.wait(lambda: consecutive() >= NOMINAL_PINGS, NOMINAL_S,
                       lambda: len(scene.ping_times()))
    result: Dict[str, Any] = {"ran": True, "works": works, "pings": consecutive(), "kinds": _kinds(control)}
    sizes = [s.ping.end - s.ping.begin for s in scene.capture.seen()] if scene.capture else []
    result["ping_bytes"] = sizes[-1] if sizes else 0
    if not works:
        result["why"] = explanation(scene)
    return result


def _kinds(control: Control) -> Dict[str, Any]:
    try:
        status, text = control._request("GET", "/api/v1/faults/kinds")
        return dict(json.loads(text)) if status == 200 else {}
    except (OSError, ValueError, http.client.HTTPException):
        return {}


def explanation(scene: Scene) -> str:
    """Explains to the developer of a driver why it gets no pings."""
    lines = []
    connections = scene.capture.connections if scene.capture else []
    taken = len(scene.capture.delivered()) if scene.capture and scene.reads_pings else len(scene.status.ping_times)
    if scene.driver.exited is not None:
        lines.append(f"The driver ended with exit code {scene.driver.exited[1]}.")
    if scene.capture and not connections:
        lines.append(f"It made no connection to {scene.address}:{scene.capture.port}. Does its command have {{ip}}?")
    elif scene.make and scene.make.needs_request and not any(c.fires for c in connections):
        lines.append("It connected but sent neither settings nor a request: the sonar pings only after one.")
    elif not taken:
        lines.append("It connected, but received no complete ping.")
    elif scene.tapped and not scene.driver.published:
        lines.append(f"It received {taken} pings, but its standard output has no tap line. A line looks like "
                     '{"id": 812, "crc32": "0a1b2c3d"}; without a tap give --tap none.')
    elif scene.tapped and len(scene.good()) < len(scene.driver.published):
        lines.append(f"It received {taken} pings, but of {len(scene.driver.published)} published ones {len(scene.good())} have the "
                     "CRC-32 of a ping's samples: docs/judge.md, \"The tap\", states which bytes these are for each make.")
    else:
        lines.append(f"It received {taken} pings, but not {NOMINAL_PINGS} consecutive ones.")
    log = (scene.folder / "driver.log").read_text(encoding="utf-8", errors="replace").splitlines()[-12:]
    if log:
        lines += ["The last lines of its output:", *(f"  {line[:160]}" for line in log)]
    return "\n".join(lines)


# ---- a case
def _case(scene: Scene, case: Case) -> Dict[str, Any]:
    driver, at_start = scene.driver, case.at == "start"
    by_lab = case.needs_lab
    if by_lab and at_start:
        _apply(scene, case)
    scene.say("driver started")
    driver.start()
    began, ended = _fault(scene, case, by_lab, at_start)
    if began is None:
        driver.poll()
        if driver.exited is None and scene.ping_times():
            return {"ran": False, "why": f"the fault did not begin: {_last_line(scene.sonard.log())}"}
        return {"ran": False, "why": "the driver received no pings before the fault", "text": explanation(scene)}
    scene.wait(lambda: _is_back(scene, began, ended), case.limit + max(0.0, ended - time.monotonic()))
    watched_until = time.monotonic()
    seen = _observe(scene, case, began, ended, watched_until)
    verdict = judge(seen, case.must, case.should, case.notice)
    if verdict.recovery == "NEVER" and not scene.sonard.ended() and (seen.exit_code is None or seen.exit_code == 0):
        seen.restarted_well = _restart(scene)
        verdict = judge(seen, case.must, case.should, case.notice)
    driver.stop()
    if scene.capture:
        scene.capture.stop()
    return result_of(scene, case, seen, verdict)


def _is_back(scene: Scene, began: float, ended: float) -> bool:
    now = time.monotonic()
    if now < ended:
        return False
    times = scene.ping_times()
    if scene.tapped and scene.capture and scene.reads_pings:
        times = sent_later(scene.good(), scene.capture.seen(), _connections(scene), began, ended)
    back = back_at(times, ended)
    return back is not None and now - [t for t in times if t >= back][BACK_PINGS - 1] >= _SETTLE_S


def _connections(scene: Scene) -> List[Tuple[float, Optional[float], str]]:
    if scene.capture:
        return [(c.opened, c.ended, c.ended_by) for c in scene.capture.connections]
    return list(scene.status.connections)


def _apply(scene: Scene, case: Case) -> None:
    assert scene.laboratory is not None
    scene.laboratory.begin(case.kind, case.given)
    scene.say(f"{case.kind} {case.name} begins")


def _fault(scene: Scene, case: Case, by_lab: bool, at_start: bool) -> Tuple[Optional[float], float]:
    """Waits until the fault has begun and ended. Returns both times; the first is None if it did not begin."""
    seconds = case.until().get("seconds", 0.0)
    if case.kind == "N00" or by_lab:
        count = 0 if at_start else int(case.begin().get("ping", 6))
        if not scene.wait(lambda: len(scene.ping_times()) >= count, _STILL_S, scene.moves):
            return None, 0.0
        began = time.monotonic()
        if by_lab and not at_start:
            _apply(scene, case)
        elif by_lab:
            began = scene.moments[0][0]
        if scene.capture:
            scene.capture.mark()
        scene.wait(lambda: time.monotonic() >= began + seconds, seconds + 1)
        time.sleep(max(0.0, began + seconds - time.monotonic()))
        if by_lab and scene.laboratory is not None:
            scene.laboratory.end(case.kind)
        ended = time.monotonic()
        scene.say(f"{case.kind} {case.name} ends")
        return began, ended
    if not scene.wait(lambda: scene.journal.first() is not None, _STILL_S, scene.moves):
        return None, 0.0
    began = scene.journal.first() or 0.0
    if scene.capture:
        scene.capture.mark()
    scene.wait(lambda: scene.journal.ended(case.times) is not None, seconds + _STILL_S + case.limit)
    ended_at = scene.journal.ended(case.times)
    if ended_at is None:  # after a crash no client is left on which the fault could end
        ended_at = max(scene.journal.last() or began, began + seconds)
    return began, ended_at + case.tail_s


def _restart(scene: Scene) -> bool:
    """Starts the driver again, as an operator would. Returns whether pings come."""
    scene.say("the judge restarts the driver, as an operator would")
    scene.driver.stop()
    scene.status.end_faults()  # ends the faults that wait for more pings
    time.sleep(0.2)
    before = time.monotonic()
    scene.driver.start()
    return scene.wait(lambda: back_at(scene.ping_times(), before) is not None, 8.0, lambda: len(scene.ping_times()))


def touched_pings(journal: Sequence[Dict[str, Any]], seen: Sequence[Seen], numbered: bool) -> List[int]:
    """Returns the numbers of the affected pings; if the journal numbers pings differently, those of the next pings sent."""
    injected = [r for r in journal if int(r.get("ping", 0) or 0) > 0 and r.get("event") == "injected"]
    if numbered:
        return [int(r["ping"]) for r in injected]
    sent = sorted((s.mono, s.ping.number) for s in seen)
    return [number for r in injected for _, number in sent[bisect.bisect(sent, (mono(r) - _EARLY_S,)):][:1]]


def _observe(scene: Scene, case: Case, began: float, ended: float, watched_until: float) -> Observation:
    scene.driver.poll()
    published = list(scene.driver.published)
    if scene.capture:
        scene.capture.catch_up()  # otherwise a ping whose packets have not been read yet would count as false
    exited = scene.driver.exited
    seen: List[Seen] = scene.capture.seen() if scene.capture else []
    delivered: List[Seen] = scene.capture.delivered() if scene.capture else []
    if scene.capture and case.needs_lab:  # the capture may see datagrams that the laboratory drops
        flows = {c.number for c in scene.capture.connections if isinstance(c, DatagramFlow)}
        delivered = [s for s in delivered if s.connection not in flows or not began <= s.mono <= ended]
    return Observation(
        began=began, ended=ended, watched_until=watched_until, tapped=scene.tapped, published=published,
        true_pings=seen, delivered=delivered,
        wire_times=[] if scene.reads_pings else list(scene.status.ping_times), connections=_connections(scene),
        touched=touched_pings(scene.journal.records, seen, scene.make is None or scene.make.numbered),
        log_times=[t for t in [scene.driver.first_line_after(began)] if t is not None],
        state_times=[s.mono for s in scene.driver.states], log_lines_s=scene.driver.lines_per_s(began),
        samples=list(scene.driver.samples), exit_code=exited[1] if exited else None, exit_time=exited[0] if exited else None,
        packets_lost=scene.capture.lost_packets if scene.capture else 0,
        truth_known=scene.reads_pings and scene.capture is not None and scene.capture.lost_packets == 0)


def main() -> int:
    folder = pathlib.Path(sys.argv[1])
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # SIGTERM must end the driver and sonard too
    try:
        result = run(folder)
    except KeyboardInterrupt:
        result = {"ran": False, "why": "stopped"}
    except (lab.LabFailed, OSError) as why:
        result = {"ran": False, "why": str(why)}
    (folder / "case.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
