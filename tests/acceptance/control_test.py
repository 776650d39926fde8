"""Tests the control interface with a running daemon: every curl example of docs/control.md, the token, rules of listeners."""
import http.client
import json
import pathlib
import re
import shlex
import shutil
import socket
import subprocess
import tempfile
import time
import unittest

from running_sonard import ROOT, SONARD, Sonard

PAGE = ROOT / "docs/control.md"
PAGE_HOST = "127.0.0.1:8088"
CURL = shutil.which("curl")


def examples():
    """Returns the command lines of the page, in order."""
    blocks = re.findall(r"^```sh\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.M | re.S)
    return [line for block in blocks for line in block.splitlines() if line.startswith("curl ")]


def parse(example):
    """Returns (method, host, path, headers, body) of a curl command with the options that the page uses."""
    words = shlex.split(example)[1:]
    method, url, headers, body = None, None, {}, None
    while words:
        word = words.pop(0)
        if word in ("-s", "-sN"):
            continue
        if word == "-H":
            name, value = words.pop(0).split(": ", 1)
            headers[name] = value
        elif word == "-X":
            method = words.pop(0)
        elif word == "-d":
            body = words.pop(0)
        elif url is None and word.startswith("http://"):
            url = word[len("http://"):]
        else:
            raise AssertionError(f"{word}: this test does not know the option")
    host, _, path = url.partition("/")
    return method or ("GET" if body is None else "POST"), host, "/" + path, headers, body


def ask(host, method, path, headers=None, body=None):
    connection = http.client.HTTPConnection(host, timeout=200)
    try:
        connection.request(method, path, body, headers or {})
        answer = connection.getresponse()
        return answer.status, answer.read().decode()
    finally:
        connection.close()


def post(host, path, message, headers=None):
    status, body = ask(host, "POST", path, {"Content-Type": "application/json", **(headers or {})}, json.dumps(message))
    return status, json.loads(body)


class Page(unittest.TestCase):
    """Runs the examples in order with one daemon."""

    def run_examples(self, run_one):
        daemon = Sonard(profile="oculus-m1200d", trajectory="way.csv", more="recording: {folder: .}",
                        arguments=["--clock", "lockstep", "--faults"])
        (pathlib.Path(daemon.folder.name) / "way.csv").write_text("# frame: ENU_FLU\nt,x,y,z\n0,-7,0,-3\n100,-5,0,-3\n", encoding="utf-8")
        with daemon:
            host = f"{daemon.address}:8088"
            for example in examples():
                with self.subTest(example):
                    run_one(example.replace(PAGE_HOST, host), host)
            self.assertIn(f"http http://{host}", daemon.log())
            self.assertEqual(daemon.stop()[0], 0)

    def check(self, path, status, text):
        self.assertEqual(status, 200, text)
        if path.startswith("/api/v1/status"):
            self.assertEqual(json.loads(text)["sonars"][0]["name"], "front")
        elif path == "/api/v1/step":
            self.assertEqual(json.loads(text), {"now_ns": "100000000", "pings": "0"})
        elif path in ("/api/v1/faults/kinds", "/api/v1/faults/journal?after=0"):
            self.assertIn("silent-open", text)
        elif path.startswith("/api/"):
            self.assertEqual(json.loads(text)["code"], "OK")
        else:
            self.assertTrue(text.strip())

    def test_every_path_has_an_example(self):
        paths = " ".join(parse(e)[2] for e in examples())
        rules = (ROOT / "daemon/server/http/http_router.cpp").read_text(encoding="utf-8")
        operations = re.findall(r'"(\w+)"', re.search(r" operations = \{(.*?)\};", rules, re.S)[1])
        self.assertGreater(len(operations), 10)
        for name in [*operations, "status", "events", "sonars", "objects", "faults", "faults/kinds", "faults/journal", "faults/reset"]:
            self.assertIn("/api/v1/" + name, paths)

    def test_our_own_client_runs_the_examples(self):
        def run_one(example, host):
            method, _, path, headers, body = parse(example)
            if "/events" in path:
                return  # this stream never ends; curl reads it in the next test
            self.check(path, *ask(host, method, path, headers, body))
        self.run_examples(run_one)

    @unittest.skipUnless(CURL, "curl is not installed")
    def test_curl_runs_the_examples(self):
        def run_one(example, _):
            events = "/events" in example
            words = [CURL, "--max-time", "2" if events else "200", *shlex.split(example)[1:]]
            done = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=240, check=False)
            self.assertEqual(done.returncode, 28 if events else 0, done.stderr)  # 28: curl's time limit ended the endless stream
            if not events:
                self.check(parse(example)[2], 200, done.stdout)
        self.run_examples(run_one)


class Running(unittest.TestCase):
    def test_the_status_has_the_settings(self):
        with Sonard() as daemon:
            host = f"{daemon.address}:8088"
            self.assertEqual(post(host, "/api/v1/sonars/front", {"range_m": 4})[0], 200)
            status = json.loads(ask(host, "GET", "/api/v1/status")[1])
            self.assertAlmostEqual(status["sonars"][0]["range_m"], 4, delta=0.1)
            code, answer = post(host, "/api/v1/sonars/rear", {"range_m": 4})
            self.assertEqual((code, answer["code"]), (400, "REFUSED"))
            self.assertIn("rear", answer["text"])
            code, answer = post(host, "/api/v1/load", {"path": "no-such-scene.yaml"})
            self.assertIn(code, (400, 409))
            self.assertIn("no-such-scene.yaml", answer["text"])

    def test_events_report_a_client_and_its_pings(self):
        with Sonard() as daemon:
            with socket.create_connection((daemon.address, 8088), timeout=100) as events:
                events.sendall(f"GET /api/v1/events?pings=1&clients=1 HTTP/1.0\r\nHost: {daemon.address}\r\n\r\n".encode())
                lines = events.makefile("r", encoding="utf-8")
                self.assertIn("200", lines.readline())
                while lines.readline().strip():
                    pass
                self.assertEqual(daemon.ctl("listen", "--pings", 2, "--quiet").returncode, 0)
                seen, deadline = set(), time.monotonic() + 100
                while seen != {"client", "ping"} and time.monotonic() < deadline:
                    seen |= set(json.loads(lines.readline())) & {"client", "ping"}
                self.assertEqual(seen, {"client", "ping"})

    def test_a_token_is_needed_everywhere_but_for_health(self):
        with tempfile.TemporaryDirectory() as folder:
            token = pathlib.Path(folder) / "token"
            token.write_text("a-secret-of-the-lab\n", encoding="utf-8")
            token.chmod(0o600)
            with Sonard(control=f", token_file: {token}") as daemon:
                host = f"{daemon.address}:8088"
                self.assertEqual(ask(host, "GET", "/healthz"), (200, "ok\n"))
                self.assertEqual(ask(host, "GET", "/api/v1/status")[0], 401)
                self.assertEqual(ask(host, "GET", "/metrics", {"Authorization": "Bearer a-secret-of-the-laB"})[0], 401)
                self.assertEqual(ask(host, "GET", "/metrics", {"Authorization": "Bearer a-secret-of-the-lab"})[0], 200)
                self.assertNotIn("a-secret", daemon.log())

    def test_pages_with_dns_rebinding_get_nothing(self):
        with Sonard(control=", hosts: [sonar-lab]") as daemon:
            host = f"{daemon.address}:8088"
            self.assertEqual(ask(host, "GET", "/api/v1/status", {"Host": "evil.example"})[0], 403)
            self.assertEqual(ask(host, "GET", "/api/v1/status", {"Host": "sonar-lab:8088"})[0], 200)
            self.assertEqual(post(host, "/api/v1/sonar", {}, {"Origin": "http://evil.example"})[0], 403)


class Starting(unittest.TestCase):
    def start(self, control):
        address = "127.0.0.9"
        with tempfile.TemporaryDirectory() as folder:
            config = pathlib.Path(folder) / "sonard.yaml"
            config.write_text(f"world: {{scene: {ROOT / 'scenes/demo.yaml'}}}\nvehicles: [{{name: rov}}]\n"
                              f"sonars: [{{name: front, profile: oculus-m1200d, bind_ip: {address}}}]\n"
                              f"poses: {{protobuf: off, json: off}}\ncontrol: {control.format(address=address, folder=folder)}\n",
                              encoding="utf-8")
            return subprocess.run([str(SONARD), "run", str(config)], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                                  timeout=120, check=False)

    def test_other_computers_need_a_token(self):
        for key in ("http", "stream"):
            done = self.start(f"{{{{{key}: '0.0.0.0:0'}}}}")
            self.assertEqual(done.returncode, 78)
            self.assertIn(f"control.{key}: can be reached from other computers", done.stderr)
            self.assertIn("control.token_file", done.stderr)

    def test_a_token_file_must_be_there(self):
        done = self.start("{{stream: off, http: '{address}:0', token_file: '{folder}/none'}}")
        self.assertEqual(done.returncode, 78)
        self.assertIn("cannot be read", done.stderr)

    def test_a_given_address_must_be_free(self):
        with socket.create_server(("127.0.0.9", 0)) as other:
            ip, port = other.getsockname()
            done = self.start(f"{{{{stream: off, http: '{ip}:{port}'}}}}")
        self.assertEqual(done.returncode, 69)
        self.assertIn("control.http in the configuration can set another address, or off", done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
