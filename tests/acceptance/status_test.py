"""Tests sonarctl status, events, set, load and object with a running daemon."""
import json
import pathlib
import re
import socket
import subprocess
import tempfile
import time
import unittest

from running_sonard import ROOT, SONARCTL, SONARD, Daemon, Sonard, eventually, run


FREE_PORTS = f"""\
world: {{scene: {ROOT}/scenes/demo.yaml}}
vehicles: [{{name: rov}}]
sonars: [{{name: front, profile: oculus-m1200d, bind_ip: ADDRESS, status_to: [ADDRESS]}}]
poses: {{protobuf: "ADDRESS:0", json: "ADDRESS:0", mavlink: "udpin:127.0.0.1:0"}}
control: {{stream: "ADDRESS:0", http: "ADDRESS:0"}}
"""


class PortZero(unittest.TestCase):
    def test_the_system_chooses_free_ports_and_sonard_prints_them(self):
        with Daemon(FREE_PORTS, str(SONARD)) as daemon:
            at = daemon.address.replace(".", "\\.")
            poses = re.search(rf"pose +udp {at}:(\d+) \(protobuf\)  udp and tcp {at}:(\d+) \(json\)  udpin:127.0.0.1:(\d+) ",
                              daemon.log())
            control = re.search(rf"control +tcp {at}:(\d+)   http http://{at}:(\d+)", daemon.log())
            self.assertTrue(poses and control, daemon.log())
            ports = poses.groups() + control.groups()
            self.assertEqual((len(set(ports)), "0" in ports), (5, False), ports)
            stream = f"{daemon.address}:{control[1]}"
            for number, (port, words) in enumerate(((poses[1], []), (poses[2], ["--json"]))):
                sent = run(SONARCTL, "pose", "once", "--xyz", f"{number + 1},2,-3", "--to", f"{daemon.address}:{port}", *words)
                self.assertEqual((sent.returncode, sent.stderr), (0, ""))

                place = f"{number + 1}.00 2.00 -3.00 m"
                eventually(lambda place=place: place in run(SONARCTL, "status", "--control", stream).stdout)


class Steering(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Sonard().__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.__exit__()

    def ctl(self, *words):
        return run(SONARCTL, *words, "--control", f"{self.daemon.address}:14770")

    def does(self, *words):
        result = self.ctl(*words)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def status(self):
        return json.loads(self.does("status", "--json"))

    def refuses(self, code, words, *expected):
        result = self.ctl(*words)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        for word in expected:
            self.assertIn(word, result.stderr)

    def test_status_for_people_and_programs(self):
        text = self.does("status")
        for word in ["sonard ", "scene ", "sonar     front", f"{self.daemon.address}:52100", "vehicle   rov", "poses "]:
            self.assertIn(word, text)
        status = self.status()
        self.assertEqual(status["sonars"][0]["name"], "front")
        self.assertEqual(status["vehicles"][0]["name"], "rov")
        self.assertEqual(status["control"], f"{self.daemon.address}:14770")
        self.assertEqual(status["http"], f"{self.daemon.address}:8088")
        self.assertIn(f"control   tcp {self.daemon.address}:14770  http {self.daemon.address}:8088\n", text)

    def test_events_come_as_they_happen(self):
        events = subprocess.Popen([str(SONARCTL), "events", "--clients", "--count", "1", "--seconds", "120", "--json", "--control",
                                   f"{self.daemon.address}:14770"], stdout=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 100
        while events.poll() is None and time.monotonic() < deadline:  # until it has subscribed and reports a client
            with socket.create_connection((self.daemon.address, 52100), 10):
                time.sleep(0.2)
        output = events.communicate(timeout=200)[0]
        self.assertEqual(json.loads(output.splitlines()[0])["client"]["sonar"], "front")

    def test_sonar_and_water_are_set(self):
        self.does("set", "sonar", "--range", "5")
        self.does("set", "water", "--temperature", "8", "--salinity", "34")
        status = self.status()
        self.assertAlmostEqual(status["sonars"][0]["range_m"], 5, delta=0.5)
        self.assertEqual(status["environment"]["temperature_c"], 8)
        self.refuses(64, ("set", "sonar"), "nothing to set")
        self.refuses(64, ("set", "water"), "nothing to set")
        self.refuses(65, ("set", "sonar", "stern", "--range", "5"), "stern")

    def test_objects_come_go_and_move(self):
        name = self.status()["objects"][0]["name"]
        self.does("object", "add", "twin", "--like", name, "--xyz", "1,2,-3")
        self.assertIn("twin", self.does("object", "list"))
        self.does("object", "place", "twin", "--xyz", "3,4,5", "--frame", "ned")
        self.does("object", "hide", "twin")
        twin = next(o for o in self.status()["objects"] if o["name"] == "twin")
        self.assertFalse(twin["visible"])
        self.assertEqual([round(twin["position"][k], 6) for k in "xyz"], [4, 3, -5])
        self.does("object", "show", "twin")
        self.does("object", "remove", "twin")
        self.assertNotIn("twin", self.does("object", "list"))
        self.refuses(65, ("object", "hide", "twin"), "twin")

    def test_another_scene_is_loaded(self):
        self.does("load", ROOT / "scenes/tank-rod.yaml")
        self.assertIn("tank", json.dumps(self.status()["scene"]))
        self.refuses(65, ("load", "no-such-scene.yaml"), "no-such-scene.yaml")
        self.does("load", ROOT / "scenes/demo.yaml")

    def test_without_a_daemon_the_exit_code_is_69(self):
        result = run(SONARCTL, "status", "--control", "127.0.0.9:14770")
        self.assertEqual(result.returncode, 69)
        self.assertIn("no sonard answers on the control stream", result.stderr)

    def test_other_ports_are_named(self):
        for port, word in [(8088, "it speaks HTTP"), (52100, "does not answer as sonard's control stream")]:
            result = run(SONARCTL, "status", "--control", f"{self.daemon.address}:{port}")
            self.assertEqual(result.returncode, 65, result.stderr)
            for expected in (f"{self.daemon.address}:{port}", word, "--control HOST:PORT", "14770"):
                self.assertIn(expected, result.stderr)

    def test_a_socket_that_is_connected_to_itself_is_not_an_answer(self):
        """If only two ports are available for outgoing connections and one of them is the target, a socket may soon be connected
        to itself."""
        command = f"ip link set lo up && echo 52100 52101 > /proc/sys/net/ipv4/ip_local_port_range && exec {SONARCTL.resolve()} status"
        if run("unshare", "-rn", "sh", "-c", command.split(" && exec")[0]).returncode != 0:
            self.skipTest("no network namespace of its own")
        result = run("unshare", "-rn", "sh", "-c", command + " --control 127.0.0.1:52100")
        self.assertEqual(result.returncode, 69, result.stderr)
        self.assertIn("no sonard answers on the control stream", result.stderr)


    def test_a_port_of_another_service_is_reported_soon(self):
        with socket.create_server((self.daemon.address, 0)) as silent:
            # The port of JSON lines, which ends a connection with other content; and a program that sends nothing.
            for port, what in ((14771, "closes the connection"), (silent.getsockname()[1], "no greeting within 2 s")):
                begin = time.monotonic()
                result = run(SONARCTL, "status", "--control", f"{self.daemon.address}:{port}")
                self.assertEqual(result.returncode, 65, result.stderr)
                for expected in (f"{self.daemon.address}:{port}", what, "another service", "14770"):
                    self.assertIn(expected, result.stderr)
                self.assertLess(time.monotonic() - begin, 20)  # 2 s on a quiet machine; the message states the time that it waited


class Secrets(unittest.TestCase):
    def test_a_token_gives_access(self):
        with tempfile.TemporaryDirectory() as folder:
            token = pathlib.Path(folder) / "token"
            token.write_text("0123456789abcdef01234567\n", encoding="utf-8")
            token.chmod(0o600)
            with Sonard(control=f', token_file: "{token}"') as daemon:
                control = ("--control", f"{daemon.address}:14770")
                refused = run(SONARCTL, "status", *control)
                self.assertNotEqual(refused.returncode, 0)
                self.assertIn(f"{daemon.address}:14770 requires a token: give --token-file FILE", refused.stderr)
                opened = run(SONARCTL, "status", *control, "--token-file", token)
                self.assertEqual(opened.returncode, 0, opened.stderr)
                self.assertEqual(run(SONARCTL, "status", *control, "--token-file", "none").returncode, 66)


if __name__ == "__main__":
    unittest.main()
