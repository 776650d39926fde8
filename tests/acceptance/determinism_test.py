"""Tests that runs in stepped time give equal bytes with any number of threads: for one sonar, and for a vehicle with three
makes."""
import hashlib
import json
import math
import pathlib
import re
import socket
import struct
import tempfile
import threading
import unittest

from depth_hold_test import Autopilot, Control
from oculus_reader import Client, fire_message
from running_sonard import ROOT, SONARD, Daemon, Sonard, eventually

PINGS = 60
STEPS, STEP_S = 20, 0.1
PATIENCE_S = 120


def run(threads, seed=1):
    """Returns the SHA-256 of the bytes that a client received, the digest that sonard printed, and the number of pings."""
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
        self.assertEqual(received, said, "the digest is that of the received bytes")
        self.assertEqual(pings, PINGS)
        self.assertEqual(runs[2], runs[1])
        self.assertEqual(runs[4], runs[1])


def way():
    """Returns a dive around the middle of the harbour, with the bow towards it: a CSV line every 0.2 s."""
    lines = ["# frame: ENU_FLU", "t_s,x_m,y_m,z_m,yaw_deg"]
    for step in range(11 + round(5 * STEPS * STEP_S)):
        turned = math.radians(4 * step / 5)
        lines.append(f"{step / 5:.1f},{-7 * math.cos(turned):.6f},{-7 * math.sin(turned):.6f},{-3 - 0.02 * step:.3f},{math.degrees(turned):.4f}")
    return "\n".join(lines) + "\n"


def profiles():
    """Returns the request continuous_start (1400) of the ping protocol, for profiles (1300)."""
    body = b"BR" + struct.pack("<HHBBH", 2, 1400, 0, 0, 1300)
    return body + struct.pack("<H", sum(body) & 0xFFFF)


def read_all(link, to):
    while data := link.recv(65536):
        to += data


class SuiteRun:
    """Runs the example and stores the bytes of its three ports, the distances of its link, and sonard's recordings. Status
    datagrams and MAVLink's heartbeats depend on the wall clock and are not stored."""

    PORTS = {"front": (("127.0.0.2", 52100), fire_message(version=2, rate_hz=10, range_=5)),
             "dvl": (("127.0.0.3", 16171), b'{"command":"get_config"}'),
             "altimeter": (("127.0.0.4", 9090), profiles())}
    RECORDED = {"front.mcap": "front", "front.pcap": "front", "dvl.mcap": "dvl", "altimeter.mcap": "altimeter"}  # four at a time

    def __init__(self, threads):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "way.csv").write_text(way(), encoding="utf-8")
            (folder / "recordings").mkdir()
            config = (ROOT / "scenes/sonard-suite.yaml").read_text(encoding="utf-8")
            assert config.count("trajectory: orbit") == 1
            config = config.replace("trajectory: orbit", "trajectory: way.csv") + "recording: {folder: recordings}\n"
            (folder / "suite.yaml").write_text(config, encoding="utf-8")
            with Daemon(folder / "suite.yaml", str(SONARD), ["--clock", "lockstep", "--digest", "--threads", threads]) as daemon:
                self.fly(daemon, folder / "recordings")
            self.recordings = {file: (folder / "recordings" / file).read_bytes() for file in self.RECORDED}

    def fly(self, daemon, recordings):
        control, autopilot = Control("127.0.0.1"), Autopilot(("127.0.0.1", 14551))
        for file, sonar in self.RECORDED.items():
            control.start_recording(file, sonar)
        autopilot.socket.sendto(autopilot.speak("HEARTBEAT", type=12, autopilot=3, mavlink_version=3), autopilot.peer)
        assert autopilot.command(511, 0) == 0  # requests a distance for each ping
        self.received, links, readers = {sonar: bytearray() for sonar in self.PORTS}, [], []
        for sonar, (at, request) in self.PORTS.items():
            links.append(socket.create_connection(at, PATIENCE_S))
            links[-1].sendall(request)
            readers.append(threading.Thread(target=read_all, args=(links[-1], self.received[sonar])))
            readers[-1].start()
        eventually(lambda: {sonar["name"]: [client["bytes_read"] for client in sonar["clients"]] for sonar in control.status()["sonars"]}
                   == {sonar: [len(request)] for sonar, (_, request) in self.PORTS.items()})  # so that time can advance
        self.pings = sum(control.step(STEP_S)["pings"] for _ in range(STEPS))
        self.distances = [tuple(sorted(message.items())) for message in autopilot.arrived()]
        control.stop_recording()
        code = daemon.stop()
        assert code == 0, daemon.log()
        for reader in readers:
            reader.join(PATIENCE_S)
        for link in links:
            link.close()
        self.said = {sonar: digest for digest, sonar in re.findall(r"sha256 ([0-9a-f]{64})  (\w+) client", daemon.log())}


class Suite(unittest.TestCase):
    def test_every_port_and_recording_is_the_same_twice(self):
        first = SuiteRun(threads=1)
        self.assertGreater(first.pings, 3 * STEPS / 2)
        self.assertEqual(first.said, {sonar: hashlib.sha256(data).hexdigest() for sonar, data in first.received.items()})
        reports = [json.loads(line) for line in first.received["dvl"].splitlines()]
        self.assertGreater(sum(report.get("velocity_valid", False) for report in reports), 5)
        self.assertGreater(sum(report["type"] == "position_local" for report in reports), 5)
        self.assertGreater(len(set(first.distances)), STEPS / 2, "the altitude changes")
        for threads in (1, 2):
            with self.subTest(threads=threads):
                again = SuiteRun(threads)
                for sonar, data in first.received.items():
                    self.assertTrue(again.received[sonar] == data, sonar)
                for file, data in first.recordings.items():
                    self.assertTrue(again.recordings[file] == data, file)
                self.assertEqual(again.distances, first.distances)


if __name__ == "__main__":
    unittest.main()
