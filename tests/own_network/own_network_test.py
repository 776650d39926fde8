"""Tests in_own_network. The addresses of its programs do not collide. Without namespaces the programs run one after the other."""
import os
import pathlib
import select
import socket
import subprocess
import sys
import unittest

PROGRAM = sys.argv.pop()
# Prints "bound" when it has the port, and keeps the port until its input ends.
HOLD = """
import socket, sys
a = socket.socket(); a.bind(("127.0.0.2", 52100)); a.listen()
b = socket.socket(socket.AF_INET, socket.SOCK_DGRAM); b.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
b.bind(("0.0.0.0", 52102)); b.sendto(b"beacon", ("127.255.255.255", 52102))
print("bound", b.recv(9), flush=True)
sys.stdin.read()
"""
CAPABILITIES = "[line for line in pathlib.Path('/proc/self/status').read_text().splitlines() if line.startswith('CapEff')]"
ONE_AT_A_TIME = "no network namespaces here: tests that open sockets run one at a time\n"


def start(script, *wrapped, **environment):
    outside = {name: value for name, value in os.environ.items() if name != "SONARD_OWN_NETWORK"}
    return subprocess.Popen([PROGRAM, *wrapped, sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True, env={**outside, **environment})


def possible():
    process = start("")
    return ONE_AT_A_TIME not in process.communicate(timeout=60)[1]


class OwnNetwork(unittest.TestCase):
    @unittest.skipUnless(possible(), "no network namespaces here")
    def test_two_programs_use_the_same_ports_at_the_same_time(self):
        with start(HOLD) as one, start(HOLD) as other:
            for process in (one, other):
                self.assertEqual(process.stdout.readline(), "bound b'beacon'\n")
            for process in (one, other):
                self.assertEqual(process.communicate(timeout=60), ("", ""))
                self.assertEqual(process.returncode, 0)

    @unittest.skipUnless(possible(), "no network namespaces here")
    def test_children_share_the_network(self):
        with socket.create_server(("127.0.0.1", 0)) as outside:
            port = outside.getsockname()[1]
            seen = start(f"""
import os, pathlib, socket, subprocess, sys
here = socket.create_server(("127.0.0.1", {port}))
inner = "import socket; socket.create_connection(('127.0.0.1', {port}), 30); print('met')"
subprocess.run([{PROGRAM!r}, sys.executable, "-c", inner], check=True)
print(os.getuid(), os.getgid(), *{CAPABILITIES})
""").communicate(timeout=60)
        self.assertEqual(seen, (f"met\n{os.getuid()} {os.getgid()} {eval(CAPABILITIES)[0]}\n", ""))

    def test_without_namespaces_the_second_program_waits_for_the_first(self):
        shared = {"SONARD_SHARED_NETWORK": "1"}
        script = "import sys; print('here', flush=True); print(sys.stdin.read(), flush=True)"
        with start(script, **shared) as one:
            self.assertEqual(one.stdout.readline(), "here\n")
            with start(script, **shared) as other:
                self.assertEqual(other.stderr.readline(), ONE_AT_A_TIME)
                self.assertEqual(select.select([other.stdout], [], [], 0.2)[0], [], "the second ran beside the first")
                self.assertEqual(one.communicate("first", timeout=60), ("first\n", ONE_AT_A_TIME))
                self.assertEqual(other.communicate("second", timeout=60)[0], "here\nsecond\n")

    def test_a_missing_program_is_named(self):
        done = subprocess.run([PROGRAM, "/nowhere/program"], capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual((done.returncode, done.stderr), (69, "/nowhere/program: No such file or directory\n"))


if __name__ == "__main__":
    unittest.main()
