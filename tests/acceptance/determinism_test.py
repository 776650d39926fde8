"""In the stepped clock a run is the same to the byte, however many threads compute it."""
import hashlib
import re
import unittest

from oculus_reader import Client, fire_message
from running_sonard import Sonard

PINGS = 200


def run(threads, seed=1):
    """SHA-256 of what a client received, and what the daemon says it sent."""
    with Sonard(trajectory="orbit", mount="{frame: FRD, xyz_m: [0.3, 0, 0.1], rpy_deg: [0, -15, 0]}",
                arguments=["--clock", "stepped", "--digest", "--exit-after-pings", PINGS, "--threads", threads, "--seed", seed]) as daemon:
        received, pings = hashlib.sha256(), 0
        with Client(daemon.address) as client:
            client.send(fire_message())
            try:
                while True:
                    kind, message = client.message()
                    received.update(message)
                    pings += kind == 0x23
            except EOFError:
                pass
        code, log = daemon.wait(), daemon.log()
    assert code == 0, log
    said = re.findall(r"sha256 ([0-9a-f]{64})", log)
    assert len(said) == 1, log
    return received.hexdigest(), said[0], pings


class Determinism(unittest.TestCase):
    def test_one_two_and_four_threads_serve_the_same_bytes(self):
        runs = {threads: run(threads) for threads in (1, 2, 4)}
        received, said, pings = runs[1]
        self.assertEqual(received, said, "the digest is of what arrives")
        self.assertEqual(pings, PINGS)
        self.assertEqual(runs[2], runs[1])
        self.assertEqual(runs[4], runs[1])


if __name__ == "__main__":
    unittest.main()
