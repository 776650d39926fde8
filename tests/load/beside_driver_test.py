"""Tests that viewers of the live view, faults at another sonar, and hosts of the UDP families do not disturb a driver, and that
all pings of these hosts are accounted for. --quick takes 3 s for each case instead of 60 s."""
import contextlib
import json
import pathlib
import re
import sys
import tempfile
import threading
import time
import unittest
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/acceptance"), str(ROOT / "tests/reliability")]
from aris_controller import PING, Controller  # noqa: E402
from foxglove_viewer import Closed, Viewer  # noqa: E402
from oculus_reader import Client, fire_message  # noqa: E402
from ping_link_test import (DOWN, OMNISCAN, PING1D, PING360, S500, SIDE, SURVEYOR, Host, frame, scan, settings, side_scan,  # noqa: E402
                            sound)
from real_pings_test import next_ping  # noqa: E402
from record import record  # noqa: E402
from running_sonard import Sonard  # noqa: E402
from waterlinked_link_test import START, receiver, why_not  # noqa: E402

QUICK = "--quick" in sys.argv
LASTS_S = 3 if QUICK else 60
RATE_HZ = 10
EIGHT_CLIENTS = "{frame: FLU, xyz_m: [0, 0, 0]}\n    clients: {max: 8}"  # inserted after `mount:`, so it also adds a key of the sonar
COMMAND = "SONARD_BUILD=build/release python3 tests/load/beside_driver_test.py"


def keep(item, figure, bound, good):
    print(f"{item}: {figure}")
    if not QUICK:
        record(item, figure, bound, good, COMMAND)


def numbers_of(client, seconds):
    """Returns the numbers of the pings that arrive in this time."""
    end, numbers = time.monotonic() + seconds, []
    while time.monotonic() < end or not numbers:
        numbers.append(next_ping(client)[0])
    return numbers


def lost_of(numbers):
    return numbers[-1] - numbers[0] + 1 - len(set(numbers))


def ask(daemon, path, body=None):
    request = urllib.request.Request(f"http://{daemon.address}:8088{path}", None if body is None else json.dumps(body).encode(),
                                     {"Content-Type": "application/json"})
    with urllib.request.urlopen(request, timeout=60) as answer:
        return answer.read().decode()


def figures(daemon):
    """Returns {"NAME{LABELS}": value} of /metrics."""
    lines = (line for line in ask(daemon, "/metrics").splitlines() if not line.startswith("#"))
    return {name: float(value) for name, value in (line.rsplit(" ", 1) for line in lines)}


def reads(viewer, over):
    with contextlib.suppress(Closed, OSError, EOFError):
        while not over.is_set():
            viewer.receive()


class BesideADriver(unittest.TestCase):
    def test_eight_viewers_of_all_channels_cost_no_ping(self):
        over = threading.Event()
        with Sonard(trajectory="orbit") as daemon, Client(daemon.address) as client, contextlib.ExitStack() as stack:
            client.send(fire_message(rate_hz=RATE_HZ))
            next_ping(client)
            for _ in range(8):
                viewer = stack.enter_context(Viewer(daemon.address)).greeted()
                viewer.subscribe(*sorted({channel["topic"] for channel in viewer.channels.values()}))
                threading.Thread(target=reads, args=(viewer, over), daemon=True).start()
            numbers = numbers_of(client, LASTS_S)
            over.set()
        lost = lost_of(numbers)
        keep("viewers", f"{lost} of {len(numbers) + lost}", "0", lost == 0)
        self.assertEqual(lost, 0)

    def test_faults_that_begin_and_end_cost_no_ping(self):
        """The faults act on the connection of another client; the driver's own connection stays."""
        with tempfile.TemporaryDirectory() as folder:
            journal = pathlib.Path(folder) / "journal.jsonl"
            with Sonard(trajectory="orbit", mount=EIGHT_CLIENTS, arguments=("--faults", "--fault-journal", str(journal))) as daemon, \
                    Client(daemon.address) as client:
                client.send(fire_message(rate_hz=RATE_HZ))
                numbers, given = [next_ping(client)[0]], 0
                end = time.monotonic() + LASTS_S
                while time.monotonic() < end:
                    with Client(daemon.address) as other:
                        other.send(fire_message(rate_hz=RATE_HZ))
                        next_ping(other)
                        kind = ("F01", "S01", "S06", "L02", "L04")[given % 5]
                        ask(daemon, "/api/v1/faults", {"do": kind, "name": f"load-{given}", "client": str(given + 2), "for": {"seconds": 0.3}})
                        given += 1
                        numbers += numbers_of(client, 0.5)
                entries = json.loads(ask(daemon, "/api/v1/faults/journal?after=0"))["journal"]
                lost_entries = figures(daemon)["sonard_fault_entries_lost_total"]
                self.assertEqual(daemon.stop()[0], 0, daemon.log())
            written = [json.loads(line)["seq"] for line in journal.read_text(encoding="utf-8").splitlines()]
        lost = lost_of(numbers)
        whole = written == [str(i + 1) for i in range(len(written))] and len(written) >= int(entries[-1]["seq"]) and lost_entries == 0
        keep("faults-beside", f"{lost} of {len(numbers) + lost}; {given} faults", "0", lost == 0)
        keep("faults-journal", f"{len(written)} entries in the file, {lost_entries:.0f} lost", "every one", whole)
        self.assertEqual(lost, 0)
        self.assertTrue(whole, (len(written), entries[-1]["seq"], lost_entries))

    def test_udp_hosts_lose_no_ping(self):
        def asks(port, begin, message):
            def host_of(daemon):
                host = Host(daemon.address, port)
                host.send(begin)
                return lambda: host.next(message, patience_s=60)
            return host_of

        def controls(daemon):
            link = Controller(daemon.address)
            link.set(1)

            def next_frame():
                link.command(PING)  # the sonar ends a connection that is silent for 10 s
                return link.frame()
            return next_frame

        def listens(_):
            udp = receiver()
            return lambda: [udp.recv(65507) for _ in ("ranges", "strengths")]

        counted, good = [], True
        starts = ", ".join(f'{k}: "{v}"' for k, v in START.items())
        families = [("ping360", asks(PING360, scan(0, 399), 2301), SIDE, ""), ("surveyor-240", asks(SURVEYOR, settings(1), 3011), DOWN, ""),
                    ("omniscan-450", asks(OMNISCAN, side_scan(1), 2198), SIDE, ""),
                    ("ping1d", asks(PING1D, frame(1400, (1300).to_bytes(2, "little")), 1300), DOWN, ""),
                    ("s500", asks(S500, sound(100, 1308), 1308), DOWN, ""), ("aris-3000", controls, SIDE, "")]
        if not why_not():
            families.append(("waterlinked-3d15", listens, SIDE, f"\n    options: {{{starts}}}"))
        for profile, host_of, mount, options in families:
            with Sonard(profile=profile + options, trajectory="orbit", mount=mount) as daemon:
                next_of_host = host_of(daemon)
                received, until = 0, time.monotonic() + LASTS_S / 6
                while time.monotonic() < until or received < 3:
                    next_of_host()
                    received += 1
                self.assertEqual(daemon.stop()[0], 0, daemon.log())
                said = re.search(r"(\d+) pings, (\d+) served, (\d+) dropped", daemon.log())
                self.assertIsNotNone(said, daemon.log())
                pings, served, dropped = (int(n) for n in said.groups())
            counted.append(f"{profile} {pings} pings, {served} served, {dropped} dropped, {received} received")
            good = good and served >= received and pings - served - dropped in (0, 1)
        keep("datagrams", "; ".join(counted), "served + dropped, one in progress at the end", good)
        self.assertTrue(good, counted)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]])
