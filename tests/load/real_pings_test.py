"""The shipped program simulates 40 Hz of 512 beams. On a machine of any speed, every tick is a ping or is counted as skipped,
and every ping is sent or is counted as dropped. --quick takes 5 s instead of 60 s."""
import pathlib
import re
import signal
import sys
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/acceptance"), str(ROOT / "tests/reliability")]
from oculus_reader import RESULT_V1, Client, fire_message  # noqa: E402
from record import record  # noqa: E402
from running_sonard import Sonard  # noqa: E402

QUICK = "--quick" in sys.argv
LASTS_S = 5 if QUICK else 60
RATE_HZ = 40


def next_ping(client):
    """Returns number and beams of a ping. It does not decode the picture, which would take longer than 25 ms here."""
    while True:
        kind, message = client.message()
        if kind == 0x23:
            result = RESULT_V1.unpack_from(message, 53)
            return result[0], result[10]


class RealPings(unittest.TestCase):
    def test_every_tick_and_ping_is_accounted_for(self):
        with Sonard(trajectory="orbit") as daemon, Client(daemon.address) as client:
            begin = time.monotonic()
            client.send(fire_message(rate_hz=RATE_HZ, range_=10.0))
            ids, beams = [], set()
            while time.monotonic() < begin + LASTS_S:
                number, count = next_ping(client)
                ids.append(number)
                beams.add(count)
            daemon.process.send_signal(signal.SIGTERM)
            lasted = time.monotonic() - begin
            try:
                while True:
                    ids.append(next_ping(client)[0])
            except EOFError:
                pass
            self.assertEqual(daemon.wait(), 0)
            log = daemon.log()
        said = re.search(r"(\d+) pings, (\d+) served, (\d+) dropped, (\d+) skipped of (\d+) ticks", log)
        self.assertIsNotNone(said, log)
        pings, served, dropped, skipped, ticks = (int(n) for n in said.groups())
        self.assertEqual(beams, {512})
        self.assertEqual(ticks, pings + skipped)
        self.assertEqual(len(ids), served, "served pings are those that arrived")
        self.assertIn(pings - served - dropped, (0, 1), "the ping in progress at the end has no client")
        self.assertEqual(ids, sorted(set(ids)))
        self.assertLessEqual(ids[-1] - ids[0] + 1 - len(ids), dropped, "missing numbers are dropped pings")
        # Ticks are counted by the clock, not by the computed pings.
        self.assertLessEqual(abs(ticks - RATE_HZ * lasted), 0.02 * RATE_HZ * lasted + RATE_HZ)
        figure = f"{ticks} ticks = {pings} pings + {skipped} skipped; {served} served, {dropped} dropped"
        print(figure)
        if not QUICK:
            record("real-pings", figure, "every one accounted for", True,
                   "SONARD_BUILD=build/release python3 tests/load/real_pings_test.py")


def scheduling(process):
    """Returns niceness and policy (0 usual, 1 SCHED_FIFO) of every thread; the first thread runs sockets and pacing."""
    tasks = sorted(pathlib.Path(f"/proc/{process.pid}/task").iterdir(), key=lambda task: int(task.name) != process.pid)
    fields = [(task / "stat").read_text(encoding="utf-8").rsplit(")", 1)[1].split() for task in tasks]
    return [(int(f[16]), int(f[38])) for f in fields]


class Threads(unittest.TestCase):
    def test_all_threads_except_the_io_thread_have_lower_priority(self):
        with Sonard(trajectory="orbit", more="engine: {threads: 4}") as daemon, Client(daemon.address) as client:
            client.send(fire_message())
            next_ping(client)
            first, *others = scheduling(daemon.process)
        self.assertGreaterEqual(len(others), 4, "too few threads of pool and simulation")
        # Pings have the highest priority, then the live view, because a person waits for its pictures, then recordings and
        # scenes.
        self.assertEqual(set(others), {(min(first[0] + nice_by, 19), 0) for nice_by in (1, 5, 10)})

    def test_real_time_priority_is_used_if_configured(self):
        with Sonard(more="engine: {io_priority: 5}") as daemon, Client(daemon.address) as client:
            client.send(fire_message())
            next_ping(client)
            first, *others = scheduling(daemon.process)
            refused = daemon.log().count("engine.io_priority has no effect")
        self.assertEqual(first[1], 0 if refused else 1)
        self.assertLessEqual(refused, 1)
        self.assertEqual({policy for _, policy in others}, {0}, "computing threads are not scheduled in real time")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]])
