"""Two network namespaces joined by a veth pair: sonard in one, a driver in the other, network faults between them.

examples:
    sonarctl lab -- mydriver --ip 10.77.0.2              SONARD_IP is set too
    sonarctl lab --do L06:seconds=5,after=10 -- mydriver
python3 -m sonard_client.lab does the same. Lines on standard input apply faults while the command runs: `L06 seconds=5`,
`end L06`, `list`.

A process cannot imitate a pulled cable, because its kernel continues to acknowledge. Here the packets themselves are dropped.
Needs root or user namespaces, and the programs unshare, nsenter and ip; most faults need nft, one needs tc. An error names
missing programs.
"""
from __future__ import annotations

import argparse
import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from typing import Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from . import DEFAULT_PROFILE
from .daemon import Daemon, DaemonFailed

DEVICE, HOST, LINK = "10.77.0.2", "10.77.0.1", "sonar0"
_HOST_LINK = "host0"
_PATH = os.environ.get("PATH", "") + ":/usr/sbin:/sbin"  # ip, nft and tc are often only on the path of root
_INSIDE = "SONARD_LAB_INSIDE"


class LabFailed(RuntimeError):
    """The laboratory cannot be made: a program is missing, or the kernel refuses."""


def program(name: str) -> Optional[str]:
    return shutil.which(name, path=_PATH)


def _run(*command: str, text: str = "") -> None:
    found = program(command[0])
    if found is None:
        raise LabFailed(f"needs the program {command[0]}")
    done = subprocess.run([found, *command[1:]], input=text, capture_output=True, text=True, check=False)
    if done.returncode:
        why = (done.stderr or done.stdout).strip().splitlines() or [f"exit code {done.returncode}"]
        raise LabFailed(f"{' '.join(command)}: {why[0]}")


def unshare_prefix() -> List[str]:
    """Returns the command that runs another one in its own network namespace, with the right to change the namespace."""
    return [program("unshare") or "unshare", *([] if os.geteuid() == 0 else ["-r"]), "-n", "--"]


def missing() -> str:
    """Returns why namespaces cannot be used here, or an empty text."""
    for name in ("unshare", "nsenter", "ip"):
        if program(name) is None:
            return f"namespaces (the program {name} is not installed)"
    tried = subprocess.run([*unshare_prefix(), program("ip") or "ip", "link", "add", "a0", "type", "veth", "peer", "name", "a1"],
                           capture_output=True, text=True, check=False)
    if tried.returncode:
        return f"namespaces ({(tried.stderr.strip().splitlines() or ['the kernel refuses'])[-1]})"
    return ""


class Fault(NamedTuple):
    """A fault of the network. begin(lab, parameters) applies it; lab.end(code) ends it."""
    name: str
    parameters: Mapping[str, str]  # with their defaults
    needs: Tuple[str, ...]         # programs
    begin: "Callable[[Lab, Mapping[str, str]], None]"


def _vanish(lab: "Lab", given: Mapping[str, str]) -> None:
    if program("nft"):
        lab.drop(lab.device, "")
        lab.drop(lab.host, "")
    else:  # without nft: the device's end of the veth pair goes down
        _run("ip", "link", "set", LINK, "down")
        lab.undo.append(lambda: _run("ip", "link", "set", LINK, "up"))


def _no_answer(lab: "Lab", given: Mapping[str, str]) -> None:
    if given["answer"] == "unreachable":
        lab.rule(lab.device, "input", "tcp flags & (syn|ack) == syn reject with icmp type host-unreachable")
    else:
        lab.drop(lab.device, "tcp flags & (syn|ack) == syn")


def _mtu_hole(lab: "Lab", given: Mapping[str, str]) -> None:
    lab.drop(lab.host, f"ip length > {int(given['bytes'])}")
    lab.drop(lab.device, f"ip length > {int(given['bytes'])}")


def _address_lost(lab: "Lab", given: Mapping[str, str]) -> None:
    at_device = given["side"] == "device"
    space, link, address = (lab.device, LINK, DEVICE) if at_device else (lab.host, _HOST_LINK, HOST)
    where = [f"{address}/24", "broadcast", "10.77.0.255", "dev", link]
    _run(*space, "ip", "addr", "del", *where)
    if not at_device:
        lab.undo.append(lab.add_route)  # the kernel removes the route with the address
    lab.undo.append(lambda: _run(*space, "ip", "addr", "add", *where))


def _one_way(lab: "Lab", given: Mapping[str, str]) -> None:
    lab.drop(lab.device, "ip length > 80" if given["what"] == "commands" else "")


def _loss_above_rate(lab: "Lab", given: Mapping[str, str]) -> None:
    _run("tc", "qdisc", "add", "dev", LINK, "root", "tbf", "rate", f"{float(given['mbit']):g}mbit", "burst", "32k",
         "latency", "20ms")
    lab.undo.append(lambda: _run("tc", "qdisc", "del", "dev", LINK, "root"))


def _fragment_lost(lab: "Lab", given: Mapping[str, str]) -> None:
    lab.drop(lab.host, "ip frag-off & 0x1fff != 0")


FAULTS: Dict[str, Fault] = {
    "L06": Fault("vanished-peer", {}, (), _vanish),
    "L09": Fault("no-answer", {"answer": "none"}, ("nft",), _no_answer),
    "L16": Fault("mtu-hole", {"bytes": "1400"}, ("nft",), _mtu_hole),
    "L17": Fault("address-lost", {"side": "device"}, (), _address_lost),
    "L18": Fault("one-way", {"what": "all"}, ("nft",), _one_way),
    "L19": Fault("loss-above-rate", {"mbit": "8"}, ("tc",), _loss_above_rate),
    "G06": Fault("ip-fragment-lost", {}, ("nft",), _fragment_lost),
}
CHOICES = {("L09", "answer"): ("none", "unreachable"), ("L17", "side"): ("device", "host"), ("L18", "what"): ("all", "commands")}


def fault_missing(code: str) -> str:
    """Returns the missing programs that a fault of the network needs."""
    return ", ".join(name for name in FAULTS[code].needs if program(name) is None)


def read_request(text: str) -> Tuple[str, Dict[str, str]]:
    """Parses "L06:seconds=5" or "vanished-peer seconds=5" into a code and its parameters. Raises ValueError."""
    name, _, rest = text.strip().replace(":", " ").partition(" ")
    code = next((code for code, fault in FAULTS.items() if name.lower() in (code.lower(), fault.name)), "")
    if not code:
        raise ValueError(f"{name}: the faults of the network are {', '.join(f'{c} {f.name}' for c, f in FAULTS.items())}")
    given = {"seconds": "5", "after": "5", **FAULTS[code].parameters}
    for part in rest.replace(",", " ").split():
        key, equals, value = part.partition("=")
        if not equals or key not in given:
            raise ValueError(f"{part}: {code} has {', '.join(given)}")
        allowed = CHOICES.get((code, key))
        if allowed and value not in allowed:
            raise ValueError(f"{part}: it must be {' or '.join(allowed)}")
        if not allowed and not 0 <= float(value) < 86400:
            raise ValueError(f"{part}: it must be between 0 and 86400")
        given[key] = value
    return code, given


class Lab:
    """The two namespaces. The caller must be inside the device's namespace: call enter() first.

    device, host: prefixes of commands that run there."""

    def __init__(self) -> None:
        self.device: List[str] = []
        self.host: List[str] = []
        self.undo: List[Callable[[], None]] = []
        self._active: Dict[str, List[Callable[[], None]]] = {}
        self._holder: Optional["subprocess.Popen[bytes]"] = None
        self._tables = 0

    @property
    def host_pid(self) -> int:
        """The id of a process in the host's namespace."""
        return self._holder.pid if self._holder else 0

    def __enter__(self) -> "Lab":
        _run("ip", "link", "set", "lo", "up")
        _run("ip", "link", "add", LINK, "type", "veth", "peer", "name", _HOST_LINK)
        self._holder = subprocess.Popen([program("unshare") or "unshare", "-n", "--", "cat"], stdin=subprocess.PIPE)
        # cat keeps the namespace alive. It ends with this process, because its input closes then.
        space = f"/proc/{self._holder.pid}/ns/net"
        deadline = time.monotonic() + 5
        while os.readlink(space) == os.readlink("/proc/self/ns/net"):
            if time.monotonic() > deadline:
                raise LabFailed("unshare -n did not make a namespace within 5 s")
            time.sleep(0.005)
        self.host = [program("nsenter") or "nsenter", f"--net={space}", "--"]
        _run("ip", "link", "set", _HOST_LINK, "netns", str(self._holder.pid))
        for prefix, link, address in ((self.device, LINK, DEVICE), (self.host, _HOST_LINK, HOST)):
            _run(*prefix, "ip", "addr", "add", f"{address}/24", "broadcast", "10.77.0.255", "dev", link)
            _run(*prefix, "ip", "link", "set", link, "up")
            _run(*prefix, "ip", "link", "set", "lo", "up")
        self.add_route()
        return self

    def add_route(self) -> None:
        """Adds a route for drivers that join a multicast group without naming an interface; here they have no default route."""
        _run(*self.host, "ip", "route", "replace", "224.0.0.0/4", "dev", _HOST_LINK)

    def __exit__(self, *_: object) -> None:
        if self._holder is not None:
            self._holder.kill()
            self._holder.wait()

    def rule(self, prefix: Sequence[str], hook: str, text: str) -> None:
        """Adds an nft rule in one namespace; the end of the fault removes it."""
        self._tables += 1
        table, at = f"fault{self._tables}", "-450" if hook == "prerouting" else "0"  # -450: before fragments are reassembled
        chain = f"chain c {{ type filter hook {hook} priority {at}; {text}; }}"
        _run(*prefix, "nft", "-f", "-", text=f"table ip {table} {{ {chain}; }}\n")
        self.undo.append(lambda: _run(*prefix, "nft", "delete", "table", "ip", table))

    def drop(self, prefix: Sequence[str], match: str) -> None:
        """Drops packets that arrive over the veth pair in one namespace; the sender gets no error."""
        link = LINK if prefix == self.device else _HOST_LINK
        self.rule(prefix, "prerouting", f"iifname {link} {match} drop")

    def begin(self, code: str, given: Mapping[str, str]) -> None:
        if code in self._active:
            raise LabFailed(f"{code} is active: end it first")
        lacking = fault_missing(code)
        if lacking:
            raise LabFailed(f"{code} needs {lacking}")
        self.undo = []
        try:
            FAULTS[code].begin(self, {**FAULTS[code].parameters, **given})
        finally:
            self._active[code] = self.undo

    def end(self, code: str) -> None:
        for act in reversed(self._active.pop(code, [])):
            act()


def enter(module: str, arguments: Sequence[str]) -> None:
    """Runs the same program inside the device's namespace in place of this process, unless it runs there already."""
    if os.environ.get(_INSIDE) == "1":
        return
    lacking = missing()
    if lacking:
        raise LabFailed(f"needs {lacking}")
    os.environ[_INSIDE] = "1"
    command = [*unshare_prefix(), sys.executable, "-m", module, *arguments]
    os.execv(command[0], command)


def lab_config(profile: str, address: str = DEVICE, more: Optional[Dict[str, object]] = None,
               sonar: Optional[Mapping[str, object]] = None) -> str:
    """Returns a configuration for tests of drivers, with a small scene and little computing. It is JSON, which is also YAML.
    `sonar`: further keys of the sonar."""
    config: Dict[str, object] = {
        "world": {"scene": "tank-rod.yaml", "seed": 1}, "vehicles": [{"name": "rov", "trajectory": "none"}],
        "sonars": [{"name": "front", "profile": profile, "bind_ip": address, **(sonar or {})}],
        "engine": {"fixed_fan": 1}}
    config.update(more or {})
    return json.dumps(config, indent=1) + "\n"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="sonarctl lab", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--keep", action="store_true", help="when the command ends, keep the laboratory until Ctrl-C")
    parser.add_argument("--do", action="append", default=[], metavar="TEXT", help="L06:seconds=5,after=10; repeatable")
    parser.add_argument("--config", metavar="TEXT", help="configuration of sonard, whose sonar has bind_ip " + DEVICE)
    parser.add_argument("--profile", metavar="TEXT", default=DEFAULT_PROFILE, help="product, without --config")
    parser.add_argument("--sonard", metavar="TEXT", default=os.environ.get("SONARD", "sonard"), help="the program")
    parser.add_argument("--check", action="store_true", help="only list what works here and what is missing")
    parser.add_argument("command", nargs=argparse.REMAINDER, metavar="-- COMMAND", help="runs in the host's namespace")
    return parser


def check() -> List[str]:
    """Returns a line for each part of the laboratory, with whether it works here."""
    lacking = missing()
    lines = [f"{'no' if lacking else 'ok':<4} {'namespaces' if not lacking else lacking}"]
    for code, fault in FAULTS.items():
        absent = lacking and "namespaces" or fault_missing(code)
        lines.append(f"{'no' if absent else 'ok':<4} {code} {fault.name}" + (f": needs {absent}" if absent else ""))
    return lines


def _say(text: str) -> None:
    print(f"lab: {text}", file=sys.stderr, flush=True)


class _Timed:
    """Applies each fault for its time, in a thread of its own."""

    def __init__(self, lab: Lab) -> None:
        self._lab, self._lock, self._stopped = lab, threading.Lock(), threading.Event()

    def start(self, code: str, given: Mapping[str, str], after: float) -> None:
        threading.Thread(target=self._act, args=(code, given, after), daemon=True).start()

    def end(self, code: str) -> None:
        with self._lock:
            self._lab.end(code)
        _say(f"{code} ended")

    def stop(self) -> None:
        self._stopped.set()

    def _act(self, code: str, given: Mapping[str, str], after: float) -> None:
        if self._stopped.wait(after):
            return
        try:
            with self._lock:
                self._lab.begin(code, given)
            _say(f"{code} {FAULTS[code].name} for {given['seconds']} s")
            if not self._stopped.wait(float(given["seconds"])):
                self.end(code)
        except LabFailed as why:
            _say(str(why))


def _apply_requests(timed: _Timed, lines: Sequence[str]) -> None:
    for line in lines:
        words = line.split()
        try:
            if not words:
                continue
            if words[0] == "list":
                for text in check():
                    _say(text)
            elif words[0] == "end" and len(words) == 2:
                timed.end(read_request(words[1])[0])
            else:
                code, given = read_request(line)
                timed.start(code, given, 0)
        except ValueError as why:
            _say(str(why))


def _run_inside(options: argparse.Namespace, command: List[str]) -> int:
    requests = [read_request(text) for text in options.do]
    config = options.config or lab_config(options.profile)
    with Lab() as lab, Daemon(config, options.sonard) as sonard, contextlib.ExitStack() as stack:
        _say(f"sonard serves {DEVICE}; the command runs on {HOST}")
        _say(f"another shell there: nsenter -t {lab.host_pid} -n, as this user inside this namespace")
        timed = _Timed(lab)
        stack.callback(timed.stop)
        environment = {key: value for key, value in os.environ.items() if key != _INSIDE}
        driver = subprocess.Popen([*lab.host, *command], stdin=subprocess.DEVNULL, env={**environment, "SONARD_IP": DEVICE})
        for code, given in requests:
            timed.start(code, given, float(given["after"]))
        threading.Thread(target=lambda: [_apply_requests(timed, [line]) for line in sys.stdin], daemon=True).start()
        try:
            result = driver.wait()
            _say(f"the command ended with {result}")
            if options.keep:
                _say("--keep: Ctrl-C ends the laboratory")
                signal.pause()
        except KeyboardInterrupt:
            driver.terminate()
            result = driver.wait()
        if sonard.process.poll() is not None:
            _say(f"sonard had ended:\n{sonard.log()[-2000:]}")
            return 69
        return result if result >= 0 else 128 - result


def main(arguments: Optional[List[str]] = None) -> int:
    given = sys.argv[1:] if arguments is None else arguments
    try:
        options = _parser().parse_args(given)
    except SystemExit as end:  # raised by the parser, which has printed why
        return 64 if end.code else 0
    command = options.command[1:] if options.command[:1] == ["--"] else options.command
    try:
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        if options.check:
            print("\n".join(check()))
            return 0
        if not command:
            raise ValueError("give the driver's command after --")
        for text in options.do:
            read_request(text)
        enter("sonard_client.lab", given)
        return _run_inside(options, command)
    except ValueError as why:
        print(f"lab: {why}", file=sys.stderr)
        return 64
    except (LabFailed, DaemonFailed, OSError) as why:
        print(f"lab: {why}", file=sys.stderr)
        return 69


if __name__ == "__main__":
    sys.exit(main())
