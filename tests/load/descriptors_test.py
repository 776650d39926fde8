"""Clients use up all file descriptors. A running stream continues, new clients get a FIN, the log has one line, and all is as
before after they have disconnected. Uses the shipped program with a lowered limit; --quick takes a shorter time."""
import pathlib
import resource
import select
import socket
import sys
import threading
import time
import unittest
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/acceptance"), str(ROOT / "tests/reliability")]
from oculus_reader import RESULT_V1, Client, fire_message  # noqa: E402
from record import record  # noqa: E402
from running_sonard import Sonard  # noqa: E402

QUICK = "--quick" in sys.argv
LASTS_S = 2 if QUICK else 15
PROFILE = "oculus-m1200d\n    clients: {max: 16, when_full: queue}"


class Neighbour(threading.Thread):
    """Reads pings until it is stopped, and detects missing ones."""

    def __init__(self, client):
        super().__init__()
        self.client, self.pings, self.missing, self.last, self.running, self.fault = client, 0, 0, None, True, None

    def run(self):
        try:
            while self.running:
                kind, message = self.client.message()
                if kind != 0x23:
                    continue
                number = RESULT_V1.unpack_from(message, 53)[0]
                if self.last is not None:
                    self.missing += number - self.last - 1
                self.last = number
                self.pings += 1
        except Exception as fault:  # the test reports it
            self.fault = fault


def visit(endpoint):
    visitor = socket.socket()
    visitor.settimeout(60)
    visitor.connect(endpoint)
    return visitor


def is_refused(endpoint):
    """Returns true if the daemon sends a FIN and no byte."""
    with visit(endpoint) as visitor:
        return visitor.recv(1) == b""


class Descriptors(unittest.TestCase):
    def flood(self, spare, limit):
        more = f"limits: {{spare_descriptors: {spare}, stall_s: 60, dead_peer_s: 120}}"  # visitors read nothing, and stay
        with Sonard(more=more, profile=PROFILE) as daemon, Client(daemon.address) as client:
            client.send(fire_message(range_=3.0))
            neighbour = Neighbour(client)
            neighbour.start()
            resource.prlimit(daemon.process.pid, resource.RLIMIT_NOFILE, (limit, limit))
            data, poses = (daemon.address, 52100), (daemon.address, 14771)
            visitors = [visit(data) for _ in range(60)]
            deadline = time.monotonic() + 60
            while "file descriptors" not in daemon.log():  # the clients connect first and keep their descriptors
                self.assertLess(time.monotonic(), deadline, daemon.log())
                time.sleep(0.05)
            visitors += [visit(poses) for _ in range(60)]
            before, end = neighbour.pings, time.monotonic() + LASTS_S
            refused = 0
            while time.monotonic() < end or refused < 3 or (neighbour.pings == before and time.monotonic() < end + 60):
                self.assertTrue(is_refused(data))
                refused += 1
                time.sleep(0.05)
            self.assertGreater(neighbour.pings, before, f"the stream stopped: {neighbour.fault}")
            log = daemon.log()
            self.assertEqual(log.count("file descriptors"), 1, log)
            for visitor in visitors:
                visitor.close()
            neighbour.running = False
            neighbour.join(60)
            self.assertIsNone(neighbour.fault)
            self.assertEqual(neighbour.missing, 0)
            with Client(daemon.address) as later:  # a slot and a descriptor are free again
                readable, _, _ = select.select([later.socket], [], [], 60)
                self.assertTrue(readable)
                self.assertNotEqual(later.socket.recv(1), b"")
            code, _ = daemon.stop()
            self.assertEqual(code, 0, daemon.log())
        return neighbour.pings, refused

    def test_the_last_descriptors_are_reserved(self):
        pings, _ = self.flood(spare=24, limit=64)
        self.assertGreater(pings, 0)

    def test_drivers_are_served_without_a_free_descriptor(self):
        pings, refused = self.flood(spare=0, limit=52)
        if not QUICK:
            record("descriptors", f"0 of {pings}, {refused} connections refused", "0", True,
                   "SONARD_BUILD=build/release python3 tests/load/descriptors_test.py")

    @staticmethod
    def is_pinged(address):
        with Client(address) as driver:
            try:
                driver.send(fire_message(range_=3.0))
                while driver.message()[0] != 0x23:
                    pass
                return True
            except (EOFError, OSError):
                return False

    def test_idle_connections_keep_no_driver_out(self):
        with Sonard(profile=PROFILE) as daemon:
            resource.prlimit(daemon.process.pid, resource.RLIMIT_NOFILE, (64, 64))
            strangers = [visit((daemon.address, port)) for port in (14770, 8088, 14771) for _ in range(33)]
            deadline = time.monotonic() + 60
            while not self.is_pinged(daemon.address):  # tries again, because it may be refused while strangers still connect
                self.assertLess(time.monotonic(), deadline, daemon.log())
            with urllib.request.urlopen(f"http://{daemon.address}:8088/healthz", timeout=20) as answer:
                self.assertEqual(answer.read(), b"ok\n")
            for stranger in strangers:
                stranger.close()


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]])
