"""The laboratory of two namespaces: requests as text, and with namespaces (skipped where there are none) a pulled cable."""
import os
import signal
import subprocess
import sys
import threading
import unittest

from common import PACKAGE, ROOT, SONARD

from sonard_client import lab


class Requests(unittest.TestCase):
    def test_codes_names_and_parameters_are_read(self):
        self.assertEqual(lab.read_request("L06:seconds=5"), ("L06", {"seconds": "5", "after": "5"}))
        self.assertEqual(lab.read_request("mtu-hole seconds=2 bytes=600"),
                         ("L16", {"seconds": "2", "after": "5", "bytes": "600"}))
        self.assertEqual(lab.read_request("l17:side=host,after=1")[1]["side"], "host")

    def test_wrong_requests_are_refused_with_the_known_ones(self):
        for text, known in (("L05", "L06 vanished-peer"), ("L06:second=5", "seconds"), ("L17:side=left", "device or host"),
                            ("L06:seconds=-1", "between 0"), ("L06:seconds=soon", "soon")):
            with self.subTest(text), self.assertRaisesRegex(ValueError, known):
                lab.read_request(text)

    def test_every_fault_is_checked(self):
        self.assertEqual(len(lab.check()), 1 + len(lab.FAULTS))


@unittest.skipIf(lab.missing(), lab.missing())
class Namespaces(unittest.TestCase):
    def run_lab(self, *arguments):
        return subprocess.run([sys.executable, "-m", "sonard_client.lab", "--sonard", str(SONARD), *arguments], timeout=60,
                              stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              env={**os.environ, "PYTHONPATH": str(PACKAGE)})

    def test_the_command_sees_the_sonar_and_its_result_is_returned(self):
        program = "import os, socket, sys; socket.create_connection((os.environ['SONARD_IP'], 52100), 5); sys.exit(7)"
        done = self.run_lab("--", sys.executable, "-c", program)
        self.assertEqual(done.returncode, 7, done.stderr)

    def test_a_group_is_joined_without_an_interface(self):
        """Before and after the driver's computer has lost its address."""
        program = ("import socket, sys\n"
                   "with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:\n"
                   "    s.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton('224.0.0.96') + bytes(4))")
        with subprocess.Popen([*lab.unshare_prefix(), sys.executable, "-c", self.LOST, program], stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              env={**os.environ, "PYTHONPATH": str(PACKAGE)}) as done:
            self.assertEqual((done.communicate(timeout=300)[0], done.returncode), ("", 0))

    LOST = """if True:
        import subprocess, sys
        from sonard_client.lab import Lab
        with Lab() as lab:
            def join():
                subprocess.run([*lab.host, sys.executable, "-c", sys.argv[1]], check=True)
            join()
            lab.begin("L17", {"side": "host", "seconds": "1", "after": "0"})
            lab.end("L17")
            join()
    """

    @unittest.skipIf(lab.fault_missing("L16"), "needs nft")
    def test_a_vanished_peer_is_silent_and_returns(self):
        driver = str(ROOT / "docs/driver-test/tiny_driver.py")  # notices 3 s of silence and connects again
        command = [sys.executable, "-m", "sonard_client.lab", "--sonard", str(SONARD), "--", sys.executable, "-u", driver, lab.DEVICE]
        said = []
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              start_new_session=True, env={**os.environ, "PYTHONPATH": str(PACKAGE)}) as laboratory:
            too_long = threading.Timer(600, os.killpg, (laboratory.pid, signal.SIGKILL))  # the driver, too
            too_long.start()

            def request(text):
                laboratory.stdin.write(text + "\n")
                laboratory.stdin.flush()

            def wait_for(text, count=1):
                for line in laboratory.stdout:
                    said.append(line)
                    count -= text in line
                    if count == 0:
                        return
                self.fail(f"no {text}: {''.join(said)}")
            try:
                wait_for('"number"', 3)
                request("L06 seconds=500")
                wait_for("timed out; reconnecting")  # after the pings that it had already received
                request("end L06")
                wait_for("L06 ended")
                wait_for('"number"', 3)
            finally:
                laboratory.terminate()
                too_long.cancel()


if __name__ == "__main__":
    unittest.main()
