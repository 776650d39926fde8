"""Tests an emulated DVL A50 with drivers: lines of JSON over TCP, and sentences on a serial line."""
import json
import math
import pathlib
import socket
import tempfile
import time
import unittest

import tshark as shark
from pcap_writer import Capture
from pseudo_terminal import PseudoTerminal
from running_sonard import ROOT, Sonard

PORT, SERIAL_PORT, PATIENCE_S = 16171, 4001, 120
DOWN = "{frame: FRD, xyz_m: [0, 0, 0], rpy_deg: [0, -90, 0]}"
ORBIT_MPS, RADIUS_M = 0.5, 7
IDS = {(-1, 1): 0, (-1, -1): 1, (1, -1): 2, (1, 1): 3}  # ids of beams, by the signs of their forward and starboard components


class Driver:
    def __init__(self, address):
        self.link = socket.create_connection((address, PORT), PATIENCE_S)
        self.lines = self.link.makefile("rb")
        self.velocities = 0  # number of received velocity reports

    def close(self):
        self.lines.close()
        self.link.close()

    def next(self, kind, wanted=lambda report: True):
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            line = self.lines.readline()
            assert line.endswith(b"\r\n"), line
            report = json.loads(line)
            self.velocities += report["type"] == "velocity"
            if report["type"] == kind and wanted(report):
                return report
        raise AssertionError(f"no such {kind} within {PATIENCE_S} s")

    def command(self, name, **parameters):
        self.link.sendall(json.dumps({"command": name, **({"parameters": parameters} if parameters else {})}).encode())  # no line end
        response = self.next("response")
        assert response["response_to"] == name, response
        return response

    def set(self, **parameters):
        response = self.command("set_config", **parameters)
        assert response["success"], response

    def velocity(self):
        return self.next("velocity", lambda report: report["velocity_valid"])


def crc8(data):
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ (0x107 if crc & 0x80 else 0)) & 0x1FF
    return crc


class SerialDriver:
    """Reads sentences from a serial line; their checksums must be right."""

    def __init__(self, line):
        self.line, self.waiting = line, b""

    def next(self, kind):
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            while b"\r\n" not in self.waiting:
                self.waiting += self.line.read(4096)
            sentence, self.waiting = self.waiting.split(b"\r\n", 1)
            body, _, checksum = sentence.rpartition(b"*")
            assert b"%02x" % crc8(body) == checksum, sentence
            name, *fields = body.decode().split(",")
            if name == kind:
                return fields
        raise AssertionError(f"no {kind} within {PATIENCE_S} s")

    def ask(self, sentence, kind):
        self.line.write(sentence.encode() + b"\r\n")
        return self.next(kind)


class Velocity(unittest.TestCase):
    """A vehicle circles through the harbour and faces its middle, so it moves to starboard."""

    @classmethod
    def setUpClass(cls):
        cls.daemon = Sonard(profile="dvl-a50", mount=DOWN, pose="{frame: ENU_FLU, xyz_m: [-7, 0, -3]}", trajectory="orbit").__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.__exit__()

    def setUp(self):
        self.driver = Driver(self.daemon.address)
        self.addCleanup(self.driver.close)
        self.driver.set(acoustic_enabled=True, range_mode="auto", mounting_rotation_offset=0, speed_of_sound=1475)

    def test_starboard_is_starboard_in_velocities_and_beams(self):
        reports = [self.driver.velocity() for _ in range(20)]
        for report in reports:
            self.assertAlmostEqual(report["vx"], 0, delta=0.03)
            self.assertAlmostEqual(report["vy"], ORBIT_MPS, delta=0.04)  # 1475 m/s is 1 % below the speed of sound in this water
            self.assertAlmostEqual(report["vz"], 0, delta=0.02)
            self.assertAlmostEqual(report["altitude"], 2, delta=1.2)  # ripples, relief and bodies of the harbour
            self.assertTrue(0 < report["fom"] < 0.05, report["fom"])
            for (_, starboard), number in IDS.items():
                beam = report["transducers"][number]
                self.assertEqual(beam["id"], number)
                if beam["beam_valid"]:
                    self.assertAlmostEqual(beam["velocity"], starboard * 0.2706 * report["vy"], delta=0.03)
        self.assertLess(reports[0]["time_of_validity"], reports[0]["time_of_transmission"])

    def test_a_mounting_rotation_turns_velocities(self):
        self.driver.set(mounting_rotation_offset=90)
        report = self.driver.next("velocity", lambda r: r["velocity_valid"] and abs(r["vx"]) > 0.3)
        self.assertAlmostEqual(report["vx"], -ORBIT_MPS, delta=0.04)
        self.assertAlmostEqual(report["vy"], 0, delta=0.04)

    def test_dead_reckoning_follows_the_circle(self):
        self.driver.velocity()
        self.assertTrue(self.driver.command("reset_dead_reckoning")["success"])
        first = self.driver.next("position_local", lambda r: math.hypot(r["x"], r["y"]) > 0.01)
        last = self.driver.next("position_local", lambda r: r["ts"] > first["ts"] + 4)
        turned = ORBIT_MPS / RADIUS_M * (last["ts"] - first["ts"])
        way = math.hypot(last["x"] - first["x"], last["y"] - first["y"])
        self.assertAlmostEqual(way, 2 * RADIUS_M * math.sin(turned / 2), delta=0.2)
        self.assertGreater(last["y"], first["y"] + 1)
        self.assertAlmostEqual((last["yaw"] - first["yaw"] + math.degrees(turned) + 180) % 360, 180, delta=3, msg="it turns to port")

    def test_pings_are_triggered_while_acoustics_are_disabled(self):
        self.driver.set(acoustic_enabled=False)
        self.driver.next("position_local")  # a ping in progress is finished then
        before = self.driver.velocities
        for _ in range(3):
            self.assertTrue(self.driver.command("trigger_ping")["success"])
        while self.driver.velocities < before + 3:
            self.driver.next("velocity")
        self.assertFalse(self.driver.command("get_config")["result"]["acoustic_enabled"])

    def test_a_pseudo_terminal_has_the_same_sentences(self):
        with PseudoTerminal(self.daemon.address, SERIAL_PORT, PATIENCE_S) as line:
            driver = SerialDriver(line)
            self.assertEqual(driver.ask("wcw", "wrw")[0], "dvl-a50")
            self.assertEqual(driver.ask("wcp,3", "wra"), [])
            self.assertEqual(driver.ask("wcc", "wrc"), ["1475", "0", "y", "n", "auto", "y"])
            fields = driver.next("wrz")
            while fields[3] != "y":
                fields = driver.next("wrz")
            beams = [driver.next("wru") for _ in range(4)]
            self.assertAlmostEqual(float(fields[0]), 0, delta=0.03)
            self.assertAlmostEqual(float(fields[1]), ORBIT_MPS, delta=0.04)
            self.assertEqual([beam[0] for beam in beams], ["0", "1", "2", "3"])
            over_tcp = self.driver.next("velocity", lambda report: report["time_of_validity"] > int(fields[7]))
            again = driver.next("wrz")
            while int(again[7]) < over_tcp["time_of_validity"]:
                again = driver.next("wrz")
            self.assertEqual(int(again[7]), over_tcp["time_of_validity"], "the same ping")
            self.assertAlmostEqual(float(again[1]), over_tcp["vy"], delta=0.001)
            self.assertEqual(len(driver.next("wrp")), 9)
            self.assertEqual(driver.ask("wcp,1", "wra"), [])


@unittest.skipIf(shark.why_not(), shark.why_not())
class UnderWireshark(unittest.TestCase):
    def test_tshark_reads_the_same(self):
        with Sonard(scene="l-targets.yaml", profile="dvl-a50") as daemon:
            driver = Driver(daemon.address)
            driver.link.sendall(b'{"command": "get_config"}')
            lines = []
            while len({json.loads(line)["type"] for line in lines}) < 3:
                lines.append(driver.lines.readline())
            driver.close()
        capture = Capture(device_port=PORT)
        capture.connect()
        capture.tcp("client", b'{"command": "get_config"}')
        sent = b"".join(lines) + b"no JSON\r\n"
        for begin in range(0, len(sent), 700):
            capture.tcp("device", sent[begin:begin + 700])
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "dvl.pcap"
            capture.write(path)
            def shown(wanted, *fields):
                chosen = [word for field in fields for word in ("-e", field)]
                return shark.tshark("-r", path, "-Y", wanted, "-T", "fields", "-E", "separator=/s", *chosen,
                                    dissector=ROOT / "protocol/dvl/dvl.lua").split()
            types = ",".join(shown("dvl.type", "dvl.type")).split(",")
            self.assertEqual(types, [json.loads(line)["type"] for line in lines])
            self.assertEqual(shown("dvl.command", "dvl.command"), ["get_config"])
            self.assertEqual(shown("dvl.responseTo", "dvl.responseTo", "dvl.success"), ["get_config", "1"])
            velocity = next(report for report in map(json.loads, lines) if report["type"] == "velocity")
            keys = "vx", "vy", "vz", "fom", "altitude"
            for key, values in zip(keys, shown("dvl.vx", *("dvl." + key for key in keys))):
                self.assertAlmostEqual(float(values.split(",")[0]), velocity[key], msg=key)
            self.assertEqual(len(shown("dvl.expert.junk", "frame.number")), 1)


if __name__ == "__main__":
    unittest.main()
