"""Tests sonarctl doctor with a healthy daemon, without a daemon, with a busy one, and with ports that other programs use."""
import json
import os
import pathlib
import socket
import subprocess
import tempfile
import time
import unittest
import urllib.request

from running_sonard import SONARCTL, Sonard, eventually, run

PATIENT = ("--within", "40")  # for busy machines; a quiet one takes 3 s


def doctor(address, *arguments, control_port=14770):
    """Returns exit code, findings by check, and the whole answer, ignoring other programs on this machine."""
    result = run(SONARCTL, "doctor", address, "--json", "--status-on", address, "--control",
                 f"{address}:{control_port}", "--http", f"{address}:8088", *arguments)
    found = json.loads(result.stdout)
    by_check = {}
    for finding in found["findings"]:
        by_check.setdefault(finding["check"], []).append(finding)
    return result.returncode, by_check, found


def doctor_by_control(daemon, *arguments):
    """Like doctor(), but only the control stream is given; the daemon reports the address of HTTP."""
    result = run(SONARCTL, "doctor", daemon.address, "--json", "--status-on", daemon.address, "--control", f"{daemon.address}:14770",
                 *PATIENT, *arguments)
    found = json.loads(result.stdout)
    return result.returncode, {f["check"]: [f] for f in found["findings"]}, found


class Doctor(unittest.TestCase):
    def expect(self, findings, check, level, *words):
        self.assertIn(check, findings, findings)
        finding = findings[check][0]
        self.assertEqual(finding["level"], level, findings)
        for word in words:
            self.assertIn(word, finding["text"] + "; " + finding["cure"])

    def test_a_healthy_daemon_passes(self):
        with Sonard() as daemon:
            code, findings, found = doctor(daemon.address, *PATIENT)
            self.expect(findings, "status", "ok", f"received back on udp 52102 from {daemon.address}")
            self.expect(findings, "ping", "ok", "accepts, first ping decoded after", "512 beams", "8 bit, size fields consistent")
            self.assertIn(findings["rate"][0]["level"], ("ok", "warn"))  # a busy machine is slow
            self.assertIn("(requested 10)", findings["rate"][0]["text"])
            self.expect(findings, "control", "ok", "sonard", "1 sonar")
            self.expect(findings, "engine", "ok", "trace backend")
            self.expect(findings, "poses", "ok", "rov")
            self.expect(findings, "http", "ok", "healthz")
            self.assertIn("ports", findings)
            self.assertEqual(found["errors"], 0)
            self.assertEqual(found["checks"], len(found["findings"]))
            self.assertEqual(code, 0)
            text = run(SONARCTL, "doctor", daemon.address, "--status-on", daemon.address, "--control", f"{daemon.address}:14770",
                       "--http", f"{daemon.address}:8088", *PATIENT)
            self.assertRegex(text.stdout, r"\n\d+ checks, 0 errors, \d+ warnings?\n$")

    def test_http_is_requested_where_the_daemon_serves_it(self):
        with Sonard() as daemon:
            code, findings, _ = doctor_by_control(daemon)
            self.expect(findings, "http", "ok", f"http://{daemon.address}:8088/healthz returns ok")
            self.assertEqual(code, 0)
        with Sonard(http="off") as daemon:
            self.expect(doctor_by_control(daemon)[1], "http", "ok", "HTTP is not served")

    def test_a_missing_token_is_a_warning_that_names_the_option(self):
        with tempfile.TemporaryDirectory() as folder:
            token = pathlib.Path(folder) / "token"
            token.write_text("0123456789abcdef01234567\n", encoding="utf-8")
            token.chmod(0o600)
            with Sonard(control=f', token_file: "{token}"') as daemon:
                code, findings, _ = doctor_by_control(daemon)
                self.expect(findings, "control", "warn", "requires a token", "--token-file FILE")
                self.assertEqual(code, 0)
                code, findings, _ = doctor_by_control(daemon, "--token-file", token)
                self.expect(findings, "control", "ok", "1 sonar")
                self.assertEqual(code, 0)
                token.write_text("another one, long enough\n", encoding="utf-8")
                code, findings, _ = doctor_by_control(daemon, "--token-file", token)
                self.expect(findings, "control", "fail", "is not that of control.token_file")

    def test_without_a_daemon_doctor_says_what_to_do(self):
        start = time.monotonic()
        code, findings, _ = doctor("127.0.0.9")
        self.expect(findings, "ping", "fail", "refuses the connection: no program listens there")
        self.expect(findings, "control", "fail", "no sonard answers on the control stream")
        self.assertEqual(str(findings["control"]).count("--control HOST:PORT"), 1)
        self.assertEqual(code, 69)
        self.assertLess(time.monotonic() - start, 30)  # 4 s on a quiet machine

    def test_a_port_in_use_by_another_program_is_reported(self):
        address = "127.0.0.9"
        with socket.create_server((address, 52100)) as stream, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as datagrams:
            datagrams.bind((address, 52102))  # like a driver without SO_REUSEADDR
            command = subprocess.Popen([str(SONARCTL), "doctor", address, "--json", "--status-on", address, "--control",
                                        f"{address}:14770", "--http", f"{address}:8088"], stdout=subprocess.PIPE,
                                       stderr=subprocess.DEVNULL, text=True)
            stream.settimeout(30)
            client, _ = stream.accept()
            client.sendall(b"220 mail.example ESMTP ready, please go on\r\n" * 8)
            output = command.communicate(timeout=60)[0]
            client.close()
        findings = {f["check"]: [f] for f in json.loads(output)["findings"]}
        self.expect(findings, "ping", "fail", "in place of messages of an Oculus", f"pid {os.getpid()}")
        self.expect(findings, "status", "warn", "cannot listen on udp 52102, held without address reuse by", f"pid {os.getpid()}")
        self.assertEqual(command.returncode, 69)

    def test_the_expected_rate_is_the_one_that_was_set(self):
        with Sonard(profile="m3") as daemon:
            done = run(SONARCTL, "set", "sonar", "--rate", 2, "--control", f"{daemon.address}:14770")
            self.assertEqual(done.returncode, 0, done.stderr)
            _, findings, _ = doctor(daemon.address, *PATIENT)
        self.assertIn("(requested 2)", findings["rate"][0]["text"])

    def test_a_busy_sonar_is_left_alone(self):
        with Sonard() as daemon, socket.create_connection((daemon.address, 52100), 10) as driver:
            driver.settimeout(10)
            self.assertTrue(driver.recv(16))  # dummies arrive, so the driver is served
            code, findings, _ = doctor(daemon.address, *PATIENT)
            self.expect(findings, "ping", "ok", "is busy", f":{driver.getsockname()[1]}", "not connecting")
            # Without the control stream the result is the same; it comes from the kernel and the status message.
            _, findings, _ = doctor(daemon.address, *PATIENT, control_port=1)
            self.expect(findings, "ping", "ok", "is busy", "not connecting")
            self.assertNotIn("client refused", daemon.log())
            # This sonar has one slot, which the driver keeps.
            _, findings, _ = doctor(daemon.address, "--take", *PATIENT)
            self.expect(findings, "ping", "warn", "closed the connection without a byte", "clients.max")
            self.assertTrue(driver.recv(16))

    def examine_driver(self, daemon, port, sent):
        """Runs doctor beside a driver that has sent these bytes, after the daemon has handled them. Returns the findings, and
        whether the driver was still connected."""
        with socket.create_connection((daemon.address, port), 10) as driver:
            driver.sendall(sent)
            own = f":{driver.getsockname()[1]}"

            def is_noticed():
                sonar = daemon.status()["sonars"][0]
                client = (sonar.get("clients") or [{}])[0]
                return (float(client.get("connected_s", 0)) > 1 and int(client.get("bytes_read", 0)) == len(sent)) or \
                    sonar.get("gone", {}).get("address", "").endswith(own)

            eventually(is_noticed)
            code, findings, found = doctor(daemon.address, *PATIENT)
            self.assertEqual(code, 69, found)
            self.assertIn(own, findings["driver"][0]["text"])
            return findings, "is connected" in findings["driver"][0]["text"]

    def test_a_driver_that_gets_no_ping_is_an_error_for_every_make(self):
        # Port, whether other bytes leave the connection open, the name of a request, and what a driver must send.
        makes = {"oculus-m1200d": (52100, True, "fire message", "0x15"), "blueview-p900-90": (14750, False, "", "request for a ping"),
                 "aris-3000": (56888, False, "", "SET_ACOUSTICS"), "surveyor-240": (62312, True, "request", "ping_enable"),
                 "omniscan-450": (51200, True, "request", "os_ping_params"), "ping1d": (9090, True, "request", "continuous_start"),
                 "s500": (51200, True, "request", "set_ping_params")}
        for profile, (port, takes_junk, request, remedy) in makes.items():
            with self.subTest(profile=profile), Sonard(scene="l-targets.yaml", profile=profile) as daemon:
                findings, is_connected = self.examine_driver(daemon, port, b"GOOD DAY, SONAR\r\n")
                self.assertEqual(is_connected, takes_junk)
                if takes_junk:
                    self.expect(findings, "driver", "fail", "is connected to front and has not asked for pings",
                                f"17 bytes, no valid {request} among them", remedy)
                    continue
                self.expect(findings, "driver", "fail", "The connection of ", "before its first ping", remedy)
                is_connected = False
                while not is_connected:  # a driver that is silent for 10 s is disconnected, and on a busy machine doctor may take longer
                    findings, is_connected = self.examine_driver(daemon, port, b"")
                self.expect(findings, "driver", "fail", "is connected to front and has not asked for pings: it has sent nothing", remedy)

    def test_an_http_host_that_gets_no_image_is_an_error(self):
        with Sonard(scene="l-targets.yaml", profile="waterlinked-3d15") as daemon:
            code, findings, found = doctor(daemon.address, *PATIENT)
            self.expect(findings, "ping", "warn", "no images are made", "post true to /acoustics/enabled")
            self.assertEqual(code, 0, found)  # no host has set it up
            request = urllib.request.Request(f"http://{daemon.address}/api/v1/integration/acoustics/range",
                                             b'{"min": 0, "max": 5}', {"Content-Type": "application/json"})
            with urllib.request.urlopen(request, timeout=30) as reply:
                self.assertEqual(reply.status, 204)
            code, findings, found = doctor(daemon.address, *PATIENT)
            self.assertEqual(code, 69, found)
            self.expect(findings, "ping", "fail", "no images are made, although ", "a mode to /udp")

    def test_a_driver_that_gets_no_ping_is_an_error_beside_doctors_own_pings(self):
        with Sonard(scene="l-targets.yaml", arguments=("--clients", "2")) as daemon, \
                socket.create_connection((daemon.address, 52100), 10) as driver:
            driver.sendall(b"GOOD DAY, SONAR\r\n")
            eventually(lambda: float((daemon.status()["sonars"][0].get("clients") or [{}])[0].get("connected_s", 0)) > 1)
            # The sonar waits for a request of the first driver, so doctor waits for a ping until its time limit.
            code, findings, found = doctor(daemon.address, "--take", "--within", "10")
            self.assertEqual(code, 69, found)
            self.expect(findings, "driver", "fail", f":{driver.getsockname()[1]} is connected to front and has not asked for pings")
            self.assertEqual(len(findings["driver"]), 1, found)  # not doctor's own connection

    def test_a_driver_that_gets_pings_is_not_an_error(self):
        with Sonard(scene="l-targets.yaml") as daemon:
            with subprocess.Popen([str(SONARCTL), "listen", daemon.address, "--wait", "100", "--quiet"], stdout=subprocess.DEVNULL) as driver:
                try:
                    eventually(lambda: int((daemon.status()["sonars"][0].get("clients") or [{}])[0].get("pings_written", 0)) > 0)
                    code, findings, found = doctor(daemon.address, *PATIENT)
                    self.expect(findings, "ping", "ok", "is busy")
                    self.assertEqual(code, 0, found)
                finally:
                    driver.terminate()

    def test_an_address_of_no_host_is_explained(self):
        alone = ["unshare", "--user", "--map-root-user", "--net"]  # in a separate network, which no packet leaves
        try:
            subprocess.run([*alone, "true"], check=True, capture_output=True, timeout=30)
        except (OSError, subprocess.SubprocessError):
            self.skipTest("no network namespaces for this user (unshare --user --net)")
        result = run(*alone, SONARCTL, "doctor", "192.0.2.7", "--status-on", "127.0.0.1")
        self.assertEqual(result.returncode, 69, result.stdout)
        self.assertIn("tcp 192.0.2.7:52100 does not answer", result.stdout)
        self.assertIn("not on this host", result.stdout)
        self.assertIn("ip addr add 192.0.2.7/24", result.stdout)


if __name__ == "__main__":
    unittest.main()
