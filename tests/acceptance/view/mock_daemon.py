"""A daemon for the page's tests: serves the built page and the live view's socket with made-up data. Standard library only.

    mock = MockDaemon(page_folder, pings);  mock.start();  mock.state("standby")

By hand: mock_daemon.py PAGE_FOLDER RENDERED_FOLDER [STATE] [PORT]
"""
import base64
import gzip
import http.server
import json
import math
import pathlib
import re
import struct
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import made_up_scene  # noqa: E402  pylint: disable=wrong-import-position
from protobuf_writer import Schema  # noqa: E402  pylint: disable=wrong-import-position
from websocket import BINARY, TEXT, WebSocket, accept_key  # noqa: E402  pylint: disable=wrong-import-position

ROOT = pathlib.Path(__file__).resolve().parents[3]
PROTOS = ["protocol/foxglove/schemas/foxglove.proto", "protocol/foxglove/schemas/view.proto", "protocol/control/control.proto"]
TOPICS = {"/front/image": "foxglove.RawImage", "/front/fan": "foxglove.RawImage", "/front/geometry": "sonar.v1.PingGeometry",
          "/front/ping": "sonar.v1.PingEvent", "/tf": "foxglove.FrameTransforms", "/scene": "foxglove.SceneUpdate",
          "/swath": "foxglove.SceneUpdate", "/log": "foxglove.Log", "/status": "sonar.v1.DaemonStatus",
          "/doctor": "sonar.v1.Findings", "/faults": "sonar.v1.FaultReport"}
TROUBLES = ["lease_renewal", "bad_connector", "thin_tether", "power_cycle", "wrong_subnet", "second_operator", "other_firmware",
            "overheating", "clock_step", "electrical_noise"]
# The part of the fault report about troubles.
ABOUT = {"thin_tether": {"sentence": "The tether is slow and delays data."}, "power_cycle": {"own_s": 21},
         "second_operator": {"stays": "the settings that it changed"}, "bad_connector": {"waits_for": "a ping"},
         "lease_renewal": {"sentence": "The address is withdrawn and returns.",
                           "cannot_act": [{"key": "front", "value": "needs two network namespaces: sonarctl lab"}]}}
DURATION_S = 90.0
DRIVER, SLOW, COMMANDER = "192.0.2.7:49210", "192.0.2.9:51544", "192.0.2.7:49212"
OK, WARNING, ERROR = 0, 1, 2


def read_pings(folder):
    """Reads the files of `sonard render --format raw`: [(samples, description), ...]."""
    folder = pathlib.Path(folder)
    return [(path.with_name(path.stem + "_samples.raw").read_bytes(), json.loads(path.read_text()))
            for path in sorted(folder.glob("[0-9]*.json"))]


def policy():
    """Returns the Content-Security-Policy of the daemon, read from its source."""
    text = re.sub(r'"\s*\n\s*"', "", (ROOT / "daemon/server/http/page.cpp").read_text())
    return re.search(r"default-src[^\"]*", text).group()


class MockDaemon:
    def __init__(self, page, pings, rate_hz=10.0, token=""):
        self.page, self.pings, self.rate_hz, self.token = pathlib.Path(page), pings, rate_hz, token
        self.schema = Schema(PROTOS, ROOT)
        self.lock = threading.RLock()
        self.viewers, self.refusing, self.requests = [], False, []
        self.number, self.made, self.started = 12880, 0, time.time()
        self.drops, self.position_s, self.position_at = 28, 41.6, time.time()
        self.parameters = {
            "/front/range_m": 10.0, "/front/rate_hz": 10.0, "/front/gain_percent": 50.0, "/front/mode": 1, "/front/beams": 512,
            "/front/transmit": True, "/front/view/cloud_threshold": 0.35, "/front/preview": False, "/water/temperature_c": 12.0,
            "/water/salinity_psu": 30.0, "/water/ph": 8.0, "/water/sound_speed_mps": 0.0, "/rov/trajectory/paused": False,
            "/rov/trajectory/position_s": 41.6, "/rov/trajectory/speed": 1.0, "/faults/armed": True, "/faults/clear_all": False,
            **{f"/faults/{name}": 0.0 for name in TROUBLES}}
        self.faults = {}  # trouble -> its end, in time.time()
        self.name = ""
        self.state("fine")
        self.set_calls = []
        mock = self

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_GET(self):
                mock.serve(self)

            def do_POST(self):
                mock.serve(self)

            def log_message(self, *_):
                pass
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        self.port = self.server.server_address[1]

    # ---- the simulated situation

    def state(self, name):
        """Sets one of the situations of the page, or "fine"."""
        with self.lock:
            self.name, self.faults = name, {}
            self.clock = {"stepped": "stepped", "lockstep": "lockstep", "follow": "follow"}.get(name, "realtime")
            self.pinging = name not in ("no client", "standby", "stepped", "lockstep", "follow")
            if name == "fault":
                self.faults = {"thin-tether": time.time() + 20}
            self.parameters["/front/transmit"] = name != "transmit off"
            self.parameters["/front/rate_hz"] = {"standby": 0.0, "on request": 1000.0}.get(name, 10.0)
            self.parameters["/front/preview"] = False
            self.frozen_ns = 41_600_000_000
            for viewer in list(self.viewers):
                viewer.inform()
                viewer.sent_once = set()
                viewer.catch_up()
            if name == "lost":
                self.drop_viewers()

    def drop_viewers(self):
        for viewer in list(self.viewers):
            viewer.close()

    @property
    def made_hz(self):
        return 7.2 if self.name == "slow engine" else self.rate_hz

    def now_ns(self):
        return int(time.time() * 1e9) if self.clock == "realtime" else self.frozen_ns

    def trajectory_s(self):
        if self.parameters["/rov/trajectory/paused"] or self.name in ("no pose", "stepped", "lockstep", "follow"):
            return self.position_s
        return (self.position_s + (time.time() - self.position_at) * self.parameters["/rov/trajectory/speed"]) % DURATION_S

    def seek(self, position_s):
        self.position_s, self.position_at = position_s, time.time()

    def status(self):
        up_s = time.time() - self.started
        clients = [] if self.name in ("no client",) else [
            {"address": DRIVER, "pings_written": self.made, "bytes_written": self.made * 231_000, "connected_s": 300 + up_s}]
        if self.name == "fine" or self.name == "fault":
            written = int(up_s * 7)
            clients.append({"address": SLOW, "pings_written": written, "bytes_written": written * 231_000,
                            "pings_dropped": self.drops, "connected_s": 60 + up_s})
        addresses = []
        if self.name == "commands":
            clients.append({"address": COMMANDER, "commands_only": True, "requests": 3, "connected_s": 60 + up_s})
            addresses = [{"protocol": "tcp", "address": "127.0.0.2:2210", "carries": "points"},
                         {"protocol": "tcp", "address": "127.0.0.2:2209", "carries": "commands"},
                         {"protocol": "status", "address": "127.255.255.255:9", "sonar_speaks_first": True}]
        trajectory = None if self.name in ("follow", "no pose") else {
            "file": "survey.csv", "position_s": self.trajectory_s(), "duration_s": DURATION_S,
            "speed": self.parameters["/rov/trajectory/speed"], "paused": self.parameters["/rov/trajectory/paused"], "loop": True}
        description = self.pings[0][1]
        return {"version": "0.2.0", "config": "sonard.yaml", "scene": "scenes/demo.yaml", "clock": self.clock, "uptime_s": up_s,
                "now_ns": self.now_ns(), "faults_armed": True,
                "sonars": [{"name": "front", "profile": "oculus-m1200d", "listens": "127.0.0.2:52100", "pinging": self.pinging,
                            "range_m": self.parameters["/front/range_m"], "rate_hz": self.parameters["/front/rate_hz"],
                            "gain_db": 67.2, "frequency_hz": 0 if self.name == "on request" else 2.1e6, "beams": 512,
                            "rows": description["settings"]["rows"], "transmits": self.parameters["/front/transmit"],
                            "addresses": addresses, "clients": clients, "asked_by": DRIVER if self.name == "standby" else "",
                            "on_request": self.name == "on request",
                            "figures": {"pings": self.made, "made_hz": self.made_hz if self.pinging else 0, "simulation_ms": 138 if self.name == "slow engine" else 22.5,
                                        "latency_ms_p50": 26.2, "latency_ms_p99": 40}}],
                "vehicles": [{"name": "rov", "source": "" if self.name == "follow" else "trajectory survey.csv",
                              "stale": self.name == "no pose" and time.time() - self.position_at > 1, "trajectory": trajectory}],
                "objects": [{"name": "bed", "material": "sand", "visible": True}]}

    def findings(self):
        well = [("address", "127.0.0.2:52100 is open."), ("status", "Status messages go to 127.255.255.255."),
                ("range", "The range fits the scene."), ("pose", "Poses come at 50 Hz."), ("scene", "The scene is loaded."),
                ("clock", "The clock runs in real time.")]
        bad = {
            "fine": [(WARNING, "reads", "192.0.2.9 does not read fast enough.",
                      f"{self.drops} pings dropped in the last minute. Look at its CPU, or ask for fewer beams.")],
            "fault": [(ERROR, "fault", "A fault slows front down: thin-tether.", "It ends by itself.")],
            "no client": [(WARNING, "client", "No driver has connected to front.",
                           "Point a driver at 127.0.0.2, TCP port 52100.")],
            "standby": [(WARNING, "standby", "192.0.2.7 has set the rate to 0.", "Ask for a rate of 5 to 15 Hz.")],
            "transmit off": [(WARNING, "transmit", "Transmit is off: pictures hold noise only.", "Set transmit to on.")],
            "no pose": [(WARNING, "pose", "rov gets no poses.", "Look at the sender of the poses.")],
            "stepped": [(ERROR, "clock", "Time stands still at 41.600 s: it moves when 127.0.0.1:40122 has taken ping 12 896; it "
                         "has not read for 8 s.", "Look at what that driver waits for.")],
            "lockstep": [(WARNING, "clock", "Time stands still at 41.600 s: it moves when control asks for a step.", "")],
            "slow engine": [(WARNING, "engine", "Computing a ping takes 138 ms: 7.2 of 10 Hz.", "Ask for fewer beams.")],
        }.get(self.name, [])
        return [*({"level": lv, "check": c, "text": t, "cure": cure, "sonar": "front"} for lv, c, t, cure in bad),
                *({"level": OK, "check": c, "text": t} for c, t in well if c not in [b[1] for b in bad])]

    def fault_report(self):
        now = time.time()
        self.faults = {name: end for name, end in self.faults.items() if end > now}
        return {"armed": True, "troubles": [{"name": name.replace("_", "-"), **ABOUT.get(name, {"sentence": "x"})} for name in TROUBLES],
                "faults": [{"name": f"{name}.{i}", "do": name, "code": code, "sonar": "front",
                            **({"state": "waiting", "waits_for": "a ping"} if name == "bad-connector" else {"state": "active", "expires_s": end - now})}
                           for name, end in self.faults.items() for i, code in enumerate(("L13", "L14"), 1)]}

    # ---- HTTP

    def serve(self, request):
        path = request.path.partition("?")[0]
        self.requests.append(request.path)
        request.rfile.read(int(request.headers.get("Content-Length", 0)))  # unread bytes would be read as the connection's next request
        if "upgrade" in request.headers.get("Connection", "").lower():
            return self.serve_socket(request)
        if path == "/api/v1/view_ticket":
            good = request.headers.get("Authorization") == f"Bearer {self.token}"
            return self.answer(request, 200 if good else 401, b'{"ticket":"00112233445566778899aabbccddeeff"}', "application/json")
        if path == "/api/v1/status":
            good = not self.token or request.headers.get("Authorization") == f"Bearer {self.token}"
            return self.answer(request, 200 if good else 401, b"{}", "application/json")
        name = "index.html" if path == "/" else path.lstrip("/")
        file = self.page / name
        if "/" in name or not file.is_file() or file.suffix not in (".html", ".js", ".css", ".svg"):
            return self.answer(request, 404, b"not found", "text/plain")
        kind = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}[file.suffix]
        return self.answer(request, 200, gzip.compress(file.read_bytes()), kind, ("Content-Encoding", "gzip"),
                           ("Content-Security-Policy", policy()), ("Cross-Origin-Opener-Policy", "same-origin"))

    @staticmethod
    def answer(request, status, body, kind, *headers):
        request.send_response(status)
        for name, value in (("Content-Type", kind), ("Content-Length", str(len(body))), *headers):
            request.send_header(name, value)
        request.end_headers()
        request.wfile.write(body)

    def serve_socket(self, request):
        if self.name == "lost" or self.token and "ticket=" not in request.path:
            return self.answer(request, 401 if self.token else 503, b"", "text/plain")
        request.send_response(101)
        for name, value in (("Upgrade", "websocket"), ("Connection", "Upgrade"), ("Sec-WebSocket-Protocol", "foxglove.sdk.v1"),
                            ("Sec-WebSocket-Accept", accept_key(request.headers["Sec-WebSocket-Key"]))):
            request.send_header(name, value)
        request.end_headers()
        request.wfile.flush()
        request.close_connection = True
        viewer = Viewer(self, WebSocket(request.connection))
        with self.lock:
            self.viewers.append(viewer)
        try:
            viewer.greet()
            viewer.read()
        except (OSError, ValueError):
            pass
        finally:
            with self.lock:
                self.viewers.remove(viewer)
        return None

    # ---- time passes

    def start(self):
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        threading.Thread(target=self.run, daemon=True).start()
        return self

    def stop(self):
        self.server.shutdown()

    def run(self):
        due = next_second = time.time()
        while True:
            now = time.time()
            with self.lock:
                if self.pinging or self.parameters["/front/preview"]:
                    self.ping()
                if now >= next_second:
                    next_second = now + 1
                    if self.name in ("fine", "fault") and int(now) % 4 == 0:
                        self.drops += 1
                    for viewer in self.viewers:
                        viewer.each_second()
            due = max(due + 1 / self.made_hz, now - 1)  # after a delay it makes up for the missing pings
            time.sleep(max(0.001, due - time.time()))

    def ping(self):
        self.number += 1
        self.made += 1
        ns = self.now_ns()
        samples, about = self.pings[self.made % len(self.pings)]
        image = self.image(ns, samples, about)
        event = {"sonar": "front", "number": self.number, "fired_at_ns": ns, "range_m": 10, "beams": 512, "simulation_ms": 22.5}
        for viewer in self.viewers:
            viewer.publish("/front/geometry", self.geometry(about), ns, once=True)
            viewer.publish("/front/ping", event, ns)
            viewer.publish("/front/image", image, ns)
            if "/front/fan" in viewer.subscriptions:
                viewer.publish("/front/fan", self.fan(ns), ns)
            viewer.publish("/tf", self.transforms(about, ns), ns)

    def image(self, ns, samples, about):
        rows, beams = about["settings"]["rows"], about["settings"]["beams"]
        step = len(samples) // rows
        encoding = {1: "mono8", 2: "mono16", 4: "32FC1"}[step // beams]
        return {"timestamp": {"seconds": ns // 10**9, "nanos": ns % 10**9}, "frame_id": "front", "width": beams, "height": rows,
                "encoding": encoding, "step": step, "data": samples}

    @staticmethod
    def fan(ns):
        """Returns a wedge with a bright spot, 720 pixels wide."""
        width, height = 720, 720
        data = bytearray(width * height)
        for y in range(0, height, 2):
            half = (height - y) * 30 // 60
            data[y * width + 360 - half:y * width + 360 + half] = bytes([60 + (y + ns // 10**8) % 60]) * (2 * half)
        return {"width": width, "height": height, "encoding": "mono8", "step": width, "data": bytes(data)}

    def geometry(self, about):
        return {"number": self.number, "row_spacing_m": about["row_spacing_m"], "full_scale": 254,
                "azimuth_rad": about["beam_azimuth_rad"]}

    def transforms(self, about, ns):
        def pose(name):
            w, x, y, z = about[name]["wxyz"]
            return dict(zip("xyz", about[name]["xyz_m"])), {"w": w, "x": x, "y": y, "z": z}
        stamp = {"seconds": ns // 10**9, "nanos": ns % 10**9}
        place, turn = pose("vehicle_in_world")
        return {"transforms": [
            {"timestamp": stamp, "parent_frame_id": "world", "child_frame_id": "rov", "translation": place, "rotation": turn},
            {"timestamp": stamp, "parent_frame_id": "rov", "child_frame_id": "front",
             "translation": {"x": 0.3, "y": 0, "z": -0.1}, "rotation": made_up_scene.quaternion(0, 15, 0)}]}

    def swath(self):
        reach, half, tall = 10.0, math.radians(30), math.radians(6)
        points = []
        for side in (-half, half):
            for up in (-tall, tall):
                end = {"x": reach * math.cos(side) * math.cos(up), "y": reach * math.sin(side), "z": reach * math.sin(up)}
                points += [{"x": 0, "y": 0, "z": 0}, end]
        return {"entities": [{"id": "swath/front", "frame_id": "front", "frame_locked": True,
                              "lines": [{"type": 2, "thickness": 1, "scale_invariant": True, "points": points}]}]}

    def set_parameter(self, name, value):
        self.set_calls.append((name, value))
        if name.startswith("/faults/") and name.removeprefix("/faults/") in TROUBLES:
            trouble = name.removeprefix("/faults/").replace("_", "-")
            if value > 0:
                self.faults[trouble] = time.time() + value
            else:
                self.faults.pop(trouble, None)
        elif name == "/faults/clear_all":
            self.faults, value = {}, False
        elif name == "/rov/trajectory/position_s":
            self.seek(value)
        elif name == "/rov/trajectory/paused":
            self.seek(self.trajectory_s())
        self.parameters[name] = value
        if name == "/front/rate_hz" and value > 0 and self.name == "standby":
            self.state("fine")


class Viewer:
    def __init__(self, mock, socket):
        self.mock, self.socket = mock, socket
        self.subscriptions, self.sent_once = {}, set()
        self.channels = dict(enumerate(TOPICS, 1))
        self.sending = threading.Lock()

    def word(self, **word):
        self.send(TEXT, json.dumps(word))

    def send(self, kind, payload):
        try:
            with self.sending:
                self.socket.send(kind, payload)
        except OSError:
            pass  # the viewer has left; its reader notices that

    def close(self):
        try:
            self.socket.stream.shutdown(2)
        except OSError:
            pass

    def inform(self):
        mock = self.mock
        steer = mock.name != "look only"
        self.word(op="serverInfo", name="sonard 0.2.0", sessionId=f"{mock.started}-{mock.name}", supportedEncodings=["json"],
                  capabilities=["parameters", "parametersSubscribe", "services"],
                  metadata={"sonard.version": "0.2.0", "sonard.clock": mock.clock, "sonard.may_steer": str(steer).lower()})
        self.word(op="parameterValues", parameters=self.values([]))

    def greet(self):
        self.inform()
        mock = self.mock
        schema = base64.b64encode(mock.schema.descriptors).decode()
        self.word(op="advertise", channels=[{"id": i, "topic": t, "encoding": "protobuf", "schemaName": TOPICS[t],
                                             "schemaEncoding": "protobuf", "schema": schema} for i, t in self.channels.items()])
        self.word(op="advertiseServices", services=[{"id": 1, "name": "/sonard/step", "type": "sonar.v1.Step"}])

    def values(self, names):
        return [{"name": n, "value": v, **({"type": "float64"} if isinstance(v, float) else {})}
                for n, v in self.mock.parameters.items() if not names or n in names]

    def read(self):
        while (message := self.socket.receive()) is not None:
            kind, payload = message
            with self.mock.lock:
                if kind == BINARY:
                    self.call(payload)
                else:
                    self.handle(json.loads(payload))

    def call(self, payload):
        service, call, size = struct.unpack_from("<III", payload, 1)
        request = json.loads(payload[13 + size:])
        self.mock.set_calls.append(("/sonard/step", request))
        self.mock.frozen_ns += int(request["dt_s"] * 1e9)
        self.send(BINARY, struct.pack("<BIII", 3, service, call, 4) + b"json{}")

    def handle(self, word):
        if word["op"] == "subscribe":
            for one in word["subscriptions"]:
                self.subscriptions[self.channels[one["channelId"]]] = one["id"]
            self.catch_up()
        elif word["op"] == "unsubscribe":
            self.subscriptions = {t: i for t, i in self.subscriptions.items() if i not in word["subscriptionIds"]}
        elif word["op"] == "getParameters":
            self.word(op="parameterValues", parameters=self.values(word["parameterNames"]), id=word.get("id"))
        elif word["op"] == "setParameters":
            for p in word["parameters"]:
                if p["name"] == "/front/range_m" and p["value"] > 40:
                    self.word(op="status", level=2, id="param:/front/range_m", message="range_m must be 0.1 to 40")
                else:
                    self.mock.set_parameter(p["name"], p["value"])
            self.word(op="parameterValues", parameters=self.values([p["name"] for p in word["parameters"]]), id=word.get("id"))
            self.each_second()

    def catch_up(self):
        """Publishes the present values of all channels, for new subscribers."""
        mock, ns = self.mock, self.mock.now_ns()
        for i, entity in enumerate(made_up_scene.entities()):
            self.publish("/scene", {"entities": [entity]}, ns, once=f"/scene {i}")
        self.publish("/swath", mock.swath(), ns, once=True)
        lines = [(2, "driver 192.0.2.9:51544 connected to front"), (3, "front: 192.0.2.9:51544 is too slow, 28 pings dropped"),
                 (4, "fault thin tether on front for 20 s, asked by 192.0.2.20"), (2, "the judge notes: 192.0.2.7 still reads, 3 pings late"),
                 (2, "range of front 5 → 10 m, asked by 192.0.2.7"), (2, "scene demo.yaml loaded in 1.3 s, 14 objects")]
        for i, (level, text) in enumerate(lines):
            self.publish("/log", {"level": level, "message": text, "name": "sonard"}, ns - (30 - 4 * i) * 10**9, once=f"/log {i}")
        samples, about = mock.pings[0]
        if mock.name not in ("no client empty", "follow"):
            self.publish("/front/geometry", mock.geometry(about), ns, once=True)
            self.publish("/front/ping", {"number": mock.number, "sonar": "front"}, ns, once="/front/ping first")
            self.publish("/front/image", mock.image(ns, samples, about), ns, once="/front/image first")
            self.publish("/tf", mock.transforms(about, ns), ns, once="/tf first")
        self.each_second()

    def each_second(self):
        mock, ns = self.mock, self.mock.now_ns()
        self.publish("/status", mock.status(), ns)
        self.publish("/doctor", {"findings": mock.findings()}, ns)
        self.publish("/faults", mock.fault_report(), ns)

    def publish(self, topic, message, ns, once=False):
        if topic not in self.subscriptions:
            return
        if once:
            key = topic if once is True else once
            if key in self.sent_once:
                return
            self.sent_once.add(key)
        payload = self.mock.schema.encode(TOPICS[topic], message)
        self.send(BINARY, struct.pack("<BIQ", 1, self.subscriptions[topic], ns) + payload)


if __name__ == "__main__":
    daemon = MockDaemon(sys.argv[1], read_pings(sys.argv[2])).start()
    daemon.state(sys.argv[3] if len(sys.argv) > 3 else "fine")
    print(f"http://127.0.0.1:{daemon.port}/", flush=True)
    threading.Event().wait()
