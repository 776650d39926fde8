"""40 Hz of 512 beams, really simulated by the shipped program: however many this machine can do, every tick is a ping or counted
as skipped, and every ping is sent or counted as dropped. --quick takes 5 s instead of 60."""
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
    """Number and beams; the picture is not looked at, which takes longer than 25 ms here."""
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
        self.assertEqual(len(ids), served, "served is what arrived")
        self.assertIn(pings - served - dropped, (0, 1), "the one under way at the end had nobody left")
        self.assertEqual(ids, sorted(set(ids)))
        self.assertLessEqual(ids[-1] - ids[0] + 1 - len(ids), dropped, "a number that is missing was dropped")
        # Ticks are what the clock says, not what was done.
        self.assertLessEqual(abs(ticks - RATE_HZ * lasted), 0.02 * RATE_HZ * lasted + RATE_HZ)
        figure = f"{ticks} ticks = {pings} pings + {skipped} skipped; {served} served, {dropped} dropped"
        print(figure)
        if not QUICK:
            record("real-pings", figure, "every one accounted for", True,
                   "SONARD_BUILD=build/release python3 tests/load/real_pings_test.py")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]])
