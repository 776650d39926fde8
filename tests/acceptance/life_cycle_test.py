"""Tests how sonard stops, restarts, and behaves after signals and freezes, and with full disks or closed outputs; its exit codes.
Figures for the reliability table are written to the folder that SONARD_RELIABILITY names. Times are asserted with
room for a busy machine; the record states whether the promised time was met."""
import contextlib
import fcntl
import os
import pathlib
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

from foxglove_viewer import Viewer
from oculus_reader import Client, fire_message
from running_sonard import ROOT, SONARCTL, SONARD, Sonard, eventually, run
from stopped_threads import stopped_threads

sys.path.insert(0, str(ROOT / "tests/reliability"))
from record import record  # noqa: E402  from the path of the line above

COMMAND = "python3 tests/acceptance/life_cycle_test.py"
ROOM = 10  # factor on promised times, for busy machines
FOUR_CLIENTS = "{frame: FLU, xyz_m: [0, 0, 0]}\n    clients: {max: 4}"  # inserted after `mount:`, so it also adds a key of the sonar
F_SETPIPE_SZ = 1031


class Reader(threading.Thread):
    """A client that reads to the end; `ending` states how the connection ended: FIN, reset, or broken, with the error."""

    def __init__(self, address, rate_hz=10):
        super().__init__(daemon=True)
        self.client, self.pings, self.arrived, self.ending = Client(address), [], [], None
        self.client.send(fire_message(rate_hz=rate_hz))
        self.start()

    def run(self):
        try:
            while True:
                self.client.socket.settimeout(120)
                first = self.client.socket.recv(1, socket.MSG_PEEK)
                if not first:
                    self.ending = "FIN"
                    break
                kind, message = self.client.message()
                if kind == 0x23:
                    self.pings.append(int.from_bytes(message[53:57], "little"))
                    self.arrived.append(time.monotonic())
        except ConnectionError:
            self.ending = "reset"
        except (AssertionError, EOFError, OSError) as error:
            self.ending = f"broken: {error!r}"
        self.client.socket.close()

    def wait_for(self, count, patience_s=120):
        deadline = time.monotonic() + patience_s
        while len(self.pings) < count and self.ending is None and time.monotonic() < deadline:
            time.sleep(0.01)
        assert len(self.pings) >= count, f"{len(self.pings)} of {count} pings; {self.ending}"

    def lost(self):
        """Returns how many numbers between the first ping and the last are missing."""
        return self.pings[-1] - self.pings[0] + 1 - len(self.pings)


def client_that_never_reads(address):
    """Returns a client that requests pings and never reads, so that the sonar soon cannot send more."""
    deaf = socket.socket()
    deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    deaf.connect((address, 52100))
    deaf.sendall(fire_message(rate_hz=40, flags=0x4B))
    return deaf


class Started:
    """sonard with standard streams chosen by the test."""

    def __init__(self, case, wrap=None, **streams):
        self.address = "127.0.0.9"
        self.config = pathlib.Path(case.enterContext(tempfile.TemporaryDirectory())) / "sonard.yaml"
        self.config.write_text(
            "world: {scene: demo.yaml}\nvehicles: [{name: rov, initial_pose: {frame: ENU_FLU, xyz_m: [-7, 0, -3]}}]\n"
            f"sonars: [{{name: front, profile: oculus-m1200d, bind_ip: {self.address}, status_to: [{self.address}]}}]\n"
            f'poses: {{protobuf: "{self.address}:14770", json: "{self.address}:14771"}}\n',
            encoding="utf-8")
        self.command = [*(wrap or []), str(SONARD), "run", str(self.config)]
        self.streams = streams
        case.addCleanup(self.kill)
        self.start()

    def start(self):
        self.process = subprocess.Popen(self.command, stdin=subprocess.DEVNULL, **self.streams)

    def kill(self):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()

    def stop(self):
        self.process.terminate()
        return self.process.wait(2 * ROOM)


def worked_s(daemon):
    """Returns the processor time that sonard has used [s]."""
    fields = pathlib.Path(f"/proc/{daemon.process.pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Stop(unittest.TestCase):
    def test_terminate_completes_messages_and_resets_clients_that_do_not_read(self):
        with Sonard(mount=FOUR_CLIENTS) as daemon:
            readers = [Reader(daemon.address, rate_hz=40) for _ in range(2)]
            for reader in readers:
                reader.wait_for(3)
            deaf = client_that_never_reads(daemon.address)
            readers[0].wait_for(len(readers[0].pings) + 20)  # by now the buffers of the client that does not read are full
            code, seconds = daemon.stop()
            for reader in readers:
                reader.join(100)
            endings = [reader.ending for reader in readers]
            record("stop-reading", ", ".join(endings), "FIN after a whole message", endings == ["FIN", "FIN"], COMMAND)
            record("stop-time", f"{seconds:.2f} s", "within 2 s", code == 0 and seconds <= 2, COMMAND)
            self.assertEqual(endings, ["FIN", "FIN"])
            self.assertEqual(code, 0, daemon.log())
            self.assertLess(seconds, 2 * ROOM)
            deaf.settimeout(20)
            with self.assertRaises(ConnectionResetError):
                while deaf.recv(65536):
                    pass
            deaf.close()
            self.assertIn("did not receive its last message in time", daemon.log())

    def test_terminate_is_quick_with_119_open_descriptors(self):
        """There are 9 drivers, 8 viewers, 20 event streams, 64 other control and pose connections, and a recording."""
        more = "recording: {folder: .}\nlimits: {control_clients: 64}"
        with Sonard(mount=FOUR_CLIENTS.replace("4", "9"), more=more) as daemon, contextlib.ExitStack() as stack:
            readers = [Reader(daemon.address) for _ in range(9)]
            address = daemon.address

            def connected(port, greeting=b"", answer=b""):
                client = stack.enter_context(socket.create_connection((address, port), timeout=60))
                client.sendall(greeting)
                if answer:
                    self.assertTrue(client.recv(4096).startswith(answer))

            for _ in range(8):
                connected(8088, f"GET / HTTP/1.1\r\nHost: {address}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                          "Sec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n".encode(), b"HTTP/1.1 101")
            for _ in range(20):
                connected(8088, f"GET /api/v1/events?pings=1 HTTP/1.1\r\nHost: {address}\r\n\r\n".encode(), b"HTTP/1.1 200")
            for port in [14770, 14771] * 32:
                connected(port)
            started = run(SONARCTL, "recording", "start", "run.oculus", "--sonar", "front", "--control", f"{address}:14770")
            self.assertEqual(started.returncode, 0, started.stderr)
            eventually(lambda: len(os.listdir(f"/proc/{daemon.process.pid}/fd")) >= 119)
            for reader in readers:
                reader.wait_for(3)
            code, seconds = daemon.stop()
            for reader in readers:
                reader.join(100)
            record("stop-119", f"{seconds:.2f} s", "within 2 s", code == 0 and seconds <= 2, COMMAND)
            self.assertEqual([reader.ending for reader in readers], ["FIN"] * 9)
            self.assertEqual(code, 0, daemon.log())
            self.assertLess(seconds, 2 * ROOM)
            self.assertIn("run.oculus", daemon.log())

    def test_terminate_is_quick_while_a_viewer_searches_a_recording(self):
        """After the last ping the file has zeros, as after a power cut. They are more than the player can read in time."""
        with tempfile.TemporaryDirectory() as folder, Sonard(more=f"recording: {{folder: {folder}}}") as daemon:
            file = pathlib.Path(folder, "cut.oculus")
            self.assertEqual(daemon.ctl("listen", "--record", file, "--pings", "3", "--seconds", "60", "--quiet").returncode, 0)
            os.truncate(file, 1 << 40)
            viewer = Viewer(daemon.address, path="/?recording=cut.oculus").greeted()
            before = worked_s(daemon)
            eventually(lambda: worked_s(daemon) > before + 0.2)  # processor time means that the search runs
            code, seconds = daemon.stop(60)
            viewer.socket.close()
            self.assertEqual(code, 0, daemon.log())
            self.assertLess(seconds, ROOM)

    def test_terminate_does_not_wait_for_threads_of_low_priority(self):
        with Sonard() as daemon, stopped_threads(daemon.process.pid) as stopped:
            self.assertGreaterEqual(stopped, 1)
            daemon.process.terminate()
            eventually(lambda: pathlib.Path(f"/proc/{daemon.process.pid}/stat").read_text(encoding="ascii").split()[2] == "Z")

    def test_a_second_terminate_ends_at_once(self):
        with Sonard(mount=FOUR_CLIENTS) as daemon:
            reader = Reader(daemon.address)
            reader.wait_for(3)
            deaf = client_that_never_reads(daemon.address)
            reader.wait_for(len(reader.pings) + 12)
            daemon.process.terminate()
            while "stopping" not in daemon.log():
                time.sleep(0.01)
            daemon.process.terminate()
            self.assertEqual(daemon.process.wait(2 * ROOM), 128 + signal.SIGTERM)
            deaf.close()

    def test_after_a_kill_and_a_restart_sonard_serves_on_the_same_address(self):
        daemon = Started(self, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        reader = Reader(daemon.address)
        reader.wait_for(2)
        daemon.process.kill()
        daemon.process.wait()
        begin = time.monotonic()
        daemon.start()
        with Client(daemon.address, patience_s=60) as client:
            client.send(fire_message())
            client.ping()
            seconds = time.monotonic() - begin
        record("kill-restart", f"{seconds:.2f} s", "within 2.5 s", seconds <= 2.5, COMMAND)
        self.assertLess(seconds, 2.5 * ROOM)
        self.assertEqual(daemon.stop(), 0)


class Undisturbed(unittest.TestCase):
    """A client that reads loses no ping if outputs cannot be written."""

    def stream(self, daemon, pings=12):
        reader = Reader(daemon.address)
        reader.wait_for(pings)
        self.provoke_log_lines(daemon.address)
        reader.wait_for(2 * pings)
        return reader

    @staticmethod
    def provoke_log_lines(address):
        """A dozen excess clients are refused; each refusal is logged until the log's limit suppresses lines."""
        for _ in range(12):
            try:
                with socket.create_connection((address, 52100), timeout=20) as visitor:
                    visitor.recv(1)
            except ConnectionError:
                pass

    def judge(self, reader, item=None, code=0):
        ending = reader.ending
        good = reader.lost() == 0 and ending == "FIN" and code == 0
        if item:
            record(item, f"{reader.lost()} of {len(reader.pings)} pings lost", "no ping lost", good, COMMAND)
        self.assertEqual((reader.lost(), ending, code), (0, "FIN", 0))

    def test_a_full_disk_of_the_log_costs_no_ping(self):
        with open("/dev/full", "wb") as full:
            daemon = Started(self, stdout=full, stderr=full)
        reader = self.stream(daemon)
        code = daemon.stop()
        reader.join(100)
        self.judge(reader, "disk-full", code)

    def test_closed_descriptors_are_not_given_to_sockets(self):
        daemon = Started(self, wrap=["sh", "-c", 'exec "$@" <&- >&- 2>&-', "sh"])
        reader = self.stream(daemon)
        taken = [os.readlink(f"/proc/{daemon.process.pid}/fd/{fd}") for fd in range(3)]
        self.assertEqual(taken, ["/dev/null"] * 3)
        code = daemon.stop()
        reader.join(100)
        self.judge(reader, "closed-output", code)

    def test_a_log_reader_that_exits_costs_no_ping(self):
        daemon = Started(self, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        daemon.process.stderr.readline()  # like head -1
        daemon.process.stderr.close()
        reader = self.stream(daemon)
        code = daemon.stop()
        reader.join(100)
        self.judge(reader, code=code)

    def test_a_log_that_nobody_reads_costs_no_ping(self):
        ours, theirs = os.pipe()
        fcntl.fcntl(theirs, F_SETPIPE_SZ, 4096)  # one page of memory, which is not writable for poll() once the banner is in it
        daemon = Started(self, stdout=subprocess.DEVNULL, stderr=theirs)
        os.close(theirs)
        reader = self.stream(daemon)
        drain = threading.Thread(target=lambda: [None for _ in iter(lambda: os.read(ours, 65536), b"")], daemon=True)
        drain.start()
        code = daemon.stop()
        reader.join(100)
        drain.join(20)
        os.close(ours)
        self.judge(reader, code=code)

    def test_a_recording_on_a_full_disk_ends_with_an_error_message_and_the_sonar_continues(self):
        with Sonard(mount=FOUR_CLIENTS) as daemon:
            reader = Reader(daemon.address)
            reader.wait_for(3)
            result = daemon.ctl("listen", "--record", "/dev/full", "--pings", "3", "--seconds", "30", "--quiet")
            self.assertEqual(result.returncode, 74, result.stdout + result.stderr)
            self.assertRegex(result.stderr, "/dev/full: No space left on device; make room")
            reader.wait_for(len(reader.pings) + 3)
            code, _ = daemon.stop()
            reader.join(100)
            self.judge(reader, code=code)

    def test_a_render_that_cannot_write_ends_with_an_error_message(self):
        def small_disk():
            resource.setrlimit(resource.RLIMIT_FSIZE, (20000, resource.RLIM_INFINITY))
        with tempfile.TemporaryDirectory() as folder:
            for kind in ("npy", "png", "raw"):
                with self.subTest(format=kind):
                    result = subprocess.run([str(SONARD), "render", str(ROOT / "scenes/sonard.yaml"), "--out", f"{folder}/{kind}",
                                             "--format", kind, "--quiet"], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                                            timeout=120, check=False, preexec_fn=small_disk)
                    self.assertEqual(result.returncode, 74, result.stderr)
                    self.assertRegex(result.stderr, rf"sonard: .*{kind}")


class Frozen(unittest.TestCase):
    def test_a_freeze_causes_no_burst_and_no_corruption(self):
        rate_hz, frozen_s = 10, 3
        with Sonard() as daemon:
            reader = Reader(daemon.address, rate_hz=rate_hz)
            reader.wait_for(10)
            os.kill(daemon.process.pid, signal.SIGSTOP)
            time.sleep(frozen_s)
            before = len(reader.pings)
            go_on = time.monotonic()
            os.kill(daemon.process.pid, signal.SIGCONT)
            reader.wait_for(before + 25)
            daemon.stop()
            reader.join(100)
        burst = sum(1 for at in reader.arrived[before:] if at - go_on < 1)
        # One second has `rate_hz` ticks; add one ping that was in progress, and one that is due at once.
        good = burst <= rate_hz + 2 and reader.ending == "FIN"
        record("stop-continue", f"{burst} pings in the first second, ended by {reader.ending}", f"at most {rate_hz + 2}, whole", good, COMMAND)
        self.assertEqual(reader.ending, "FIN")
        self.assertEqual(reader.pings, sorted(set(reader.pings)), "numbers in order, none twice")
        self.assertLessEqual(burst, rate_hz + 2)


class ExitCodes(unittest.TestCase):
    """Exit codes, and words that the error messages must contain."""

    def test_every_class_of_errors_has_its_exit_code(self):
        with tempfile.TemporaryDirectory() as folder:
            here = pathlib.Path(folder)
            (here / "bad.yaml").write_text("world: {scene: demo.yaml, seeed: 1}\nvehicles: [{name: rov}]\n"
                                          "sonars: [{name: a, profile: oculus-m1200d, bind_ip: 127.0.0.2}]\n", encoding="utf-8")
            (here / "scene.yaml").write_text("objects:\n  - {name: a, sphere: {radius_m: -1}}\n", encoding="utf-8")
            (here / "on_scene.yaml").write_text(
                "world: {scene: scene.yaml}\nvehicles: [{name: rov}]\nsonars: [{name: a, profile: oculus-m1200d, bind_ip: 127.0.0.9}]\n",
                encoding="utf-8")
            (here / "file").write_text("", encoding="utf-8")
            cases = [
                (64, [SONARD, "--no-such-option"], ["--no-such-option"]),
                (64, [SONARD, "chekc", "x.yaml"], ["chekc", 'did you mean "check"']),
                (64, [SONARD, "run", "a.yaml", "b.yaml"], ["b.yaml"]),
                (65, [SONARD, "check", here / "on_scene.yaml"], ["scene.yaml:2:"]),
                (66, [SONARD, "run", here / "none.yaml"], ["none.yaml"]),
                (69, [SONARD, "run", "--demo", "--bind", "192.0.2.7"], ["192.0.2.7", "ip addr add"]),
                (74, [SONARD, "render", ROOT / "scenes/sonard.yaml", "--out", here / "file" / "x"], ["file"]),
                (78, [SONARD, "check", here / "bad.yaml"], ["bad.yaml:1:", "seeed", 'did you mean "seed"']),
                (0, [SONARD, "--version"], []),
            ]
            for code, command, words in cases:
                with self.subTest(code=code, command=[str(c).replace(folder, ".") for c in command[1:]]):
                    result = run(*command)
                    self.assertEqual(result.returncode, code, result.stdout + result.stderr)
                    for word in words:
                        self.assertIn(word, result.stderr)

    def test_a_wrong_value_in_the_environment_names_the_variable(self):
        for variable, value in (("SONARD_THREADS", "abc"), ("SONARD_THREADS", "900"), ("SONARD_LOG_LEVEL", "loud"), ("SONARD_CLOCK", "x")):
            for words in (["run", "--demo"], ["--demo"]):
                with self.subTest(variable=variable, value=value, words=words):
                    result = subprocess.run([str(SONARD), *words], env={**os.environ, variable: value}, stdin=subprocess.DEVNULL,
                                            capture_output=True, text=True, timeout=60, check=False)
                    self.assertEqual(result.returncode, 64, result.stderr)
                    self.assertIn(variable, result.stderr)
                    self.assertNotIn("--" + variable[7:].lower().replace("_", "-"), result.stderr)

    def test_a_hangup_while_sonard_stops_changes_nothing(self):
        with Sonard() as daemon:
            daemon.process.send_signal(signal.SIGTERM)
            while daemon.process.poll() is None:
                daemon.process.send_signal(signal.SIGHUP)
                time.sleep(0.001)
            self.assertEqual(daemon.process.returncode, 0)

if __name__ == "__main__":
    unittest.main()
