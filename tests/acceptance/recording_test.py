"""sonarctl records and sonard replays: every kind of file must keep the bytes, and other readers check the files."""
import base64
import json
import os
import pathlib
import resource
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

import mcap_checker
from oculus_reader import HEADER, Client, Ping, fire_message
from running_sonard import ROOT, SONARCTL, SONARD, Sonard, eventually, run
from tshark import messages, tshark, why_not

KINDS = ["pcap", "mcap", "oculus", "raw"]
SEEDS = ROOT / "tests/fuzz/corpus"


def split(stream):
    """Returns the messages of a device's stream."""
    found = []
    while stream:
        magic, _, _, _, _, payload, _ = HEADER.unpack_from(stream)
        assert magic == 0x4F53 and len(stream) >= 16 + payload, "the stream is not a message"
        found.append(stream[:16 + payload])
        stream = stream[16 + payload:]
    return found


def oculus_log_messages(data):
    """Returns the messages of type 10 of an .oculus file, read as the table of docs/recording.md says."""
    assert struct.unpack_from("<II6s", data) == (0x11223344, 48, b"Oculus")
    at, found = 48, []
    while at < len(data):
        magic, size, kind, _, _, compression, original, payload = struct.unpack_from("<IIHH4xdH2xII", data, at)
        assert (magic, size, compression, original) == (0xAABBCCDD, 40, 0, payload)
        if kind == 10:
            found.append(data[at + 40:at + 40 + payload])
        at += 40 + payload
    return found


class Replay:
    """Runs sonard replay FILE."""

    address = "127.0.0.9"

    def __init__(self, path, *arguments):
        self.log = tempfile.TemporaryFile()
        self.process = subprocess.Popen([str(SONARD), "replay", str(path), "--ip", self.address, "--status-to", self.address,
                                         *arguments], stdin=subprocess.DEVNULL, stdout=self.log, stderr=self.log)
        self.wait_for("Ctrl-C stops")

    def wait_for(self, text):
        """Waits until the log has the text, or the replay ends."""
        deadline = time.monotonic() + 60
        while text not in self.text() and self.process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.01)

    def text(self):
        self.log.seek(0)
        return self.log.read().decode()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.log.close()

    def everything(self):
        with socket.create_connection((self.address, 52100), timeout=60) as driver:
            got = b""
            while block := driver.recv(1 << 20):
                got += block
            return got


class Files(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def path(self, kind):
        return self.folder / f"run.{kind}"

    def read(self, kind):
        return self.path(kind).read_bytes()

    def outputs(self, kinds=KINDS):
        return [word for kind in kinds for word in (f"--{kind}", self.path(kind))]


class Recorded(Files):
    def test_a_run_is_recorded_in_every_kind_of_file(self):
        with Sonard(scene="tank-rod.yaml") as daemon:
            done = daemon.ctl("record", "--pings", 6, "--range", 1, "--beams", 256, "--control", f"{daemon.address}:14770",
                              "--status-on", daemon.address,
                              *self.outputs())
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertRegex(done.stdout, r"recorded 6 pings, \d+ messages, .* MB, .* s: .*run\.pcap .*run\.mcap ")
        sent = split(self.read("raw"))
        pings = [Ping(message) for message in sent if struct.unpack_from("<H", message, 6)[0] == 0x23]
        self.assertEqual([ping.id for ping in pings], list(range(pings[0].id, pings[0].id + 6)))
        self.assertEqual(oculus_log_messages(self.read("oculus")), sent)
        self.expect_mcap(sent, pings)
        with self.subTest("tshark"):
            self.expect_capture(sent)
        for kind in KINDS:
            with self.subTest(kind), Replay(self.path(kind), "--stepped") as replay:
                self.assertEqual(replay.everything(), self.read("raw"))
                self.assertEqual(replay.process.wait(60), 0, replay.text())
        with Replay(self.path("oculus"), "--speed", "3") as replay:
            again = self.folder / "again.raw"
            done = run(SONARCTL, "listen", replay.address, "--as-it-is", "--wait", "100", "--pings", 6, "--quiet", "--record", again)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr + replay.text())
            self.assertTrue(self.read("raw").startswith(again.read_bytes()))
            self.assertEqual(len([m for m in split(again.read_bytes()) if m[6] == 0x23]), 6)

    def expect_mcap(self, sent, pings):
        checked = mcap_checker.check(self.read("mcap"))
        by_topic = {}
        for topic, _, data in checked.messages:
            by_topic.setdefault(topic, []).append(data)
        self.assertEqual(by_topic["/front/device"], sent)
        self.assertEqual(len(by_topic["/front/client"]), 1)
        for image, ping in zip(checked.read("/front/image"), pings, strict=True):
            samples = b"".join(sample.to_bytes(ping.sample_bytes, "little") for row in ping.image for sample in row)
            self.assertEqual((image["width"], image["height"], image["step"], image["frame_id"]),
                             (ping.beams, ping.rows, ping.beams * ping.sample_bytes, "front"))
            self.assertEqual((image["encoding"], image["data"] == samples), ("mono8", True))
            self.assertLess(max(map(len, by_topic["/front/image"])), len(samples) + 64)
        poses, frames = checked.read("/front/pose"), checked.read("/tf")
        self.assertGreaterEqual(len(poses), 1)
        for pose, frame in zip(poses, frames, strict=True):
            of_sonar, = frame["transforms"]
            self.assertEqual((of_sonar["parent_frame_id"], of_sonar["child_frame_id"]), (pose["frame_id"], "front"))
            self.assertEqual([of_sonar[part] for part in ("timestamp", "translation", "rotation")],
                             [pose["timestamp"], pose["pose"]["position"], pose["pose"]["orientation"]])
        done = run("env", f"PYTHONPATH={ROOT / 'clients/python'}", sys.executable, "-B", "-m", "sonard_client.convert",
                   self.path("mcap"), "-o", self.folder / "way.csv")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(all(len(status) == 142 for status in by_topic.get("/front/status", [])))

    def expect_capture(self, sent):
        if why_not():
            self.skipTest(why_not())
        found = messages(self.path("pcap"))
        self.assertFalse([m.title for m in found if m.is_junk() or m.experts])
        titles = [m for m in found if not m.title.startswith(("Oculus, fire", "Oculus, status"))]
        self.assertEqual([int(m.shown("length")[0]) for m in titles], [len(m) for m in sent])
        self.assertEqual(len([m for m in found if m.title.startswith("Oculus, fire")]), 1)
        checks = [word for name in ("ip", "tcp", "udp") for word in ("-o", f"{name}.check_checksum:TRUE")]
        bad = 'ip.checksum.status!="Good" || tcp.checksum.status=="Bad" || udp.checksum.status=="Bad" || tcp.analysis.flags'
        self.assertEqual(tshark("-r", self.path("pcap"), *checks, "-Y", bad), "")
        good = tshark("-r", self.path("pcap"), *checks, "-Y", 'tcp.checksum.status=="Good"').splitlines()
        self.assertGreater(len(good), len(sent))
        if shutil.which("editcap"):  # a pcapng file of another program
            subprocess.run(["editcap", "-F", "pcapng", self.path("pcap"), self.folder / "again.pcapng"], check=True, timeout=60)
            done = run(SONARCTL, "record", "--from", self.folder / "again.pcapng", "--raw", self.folder / "again.raw")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual((self.folder / "again.raw").read_bytes(), b"".join(sent))

    def test_ctrl_c_leaves_whole_files(self):
        with Sonard(scene="tank-rod.yaml") as daemon:
            process = subprocess.Popen([str(SONARCTL), "record", daemon.address, "--range", "1", "--beams", "256", "--no-status", "--wait", "100",
                                        *map(str, self.outputs())], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            deadline = time.monotonic() + 120
            while time.monotonic() < deadline and not (self.path("raw").exists() and self.path("raw").stat().st_size > 200_000):
                time.sleep(0.05)
            process.send_signal(signal.SIGINT)
            said = process.communicate(timeout=60)[0]
        self.assertEqual(process.returncode, 0, said)
        self.assertRegex(said, "no poses will be recorded: no sonard answers on the control stream, tcp 127.0.0.1:14770")
        sent = split(self.read("raw"))
        self.assertEqual(oculus_log_messages(self.read("oculus")), sent)
        topics = [(topic, data) for topic, _, data in mcap_checker.check(self.read("mcap")).messages]
        self.assertEqual([data for topic, data in topics if topic == "/sonar/device"], sent)


    def test_a_silent_service_at_the_usual_port_of_control_delays_little(self):
        with Sonard(scene="tank-rod.yaml") as daemon, socket.create_server(("127.0.0.1", 14770)):
            done = run(SONARCTL, "record", daemon.address, "--range", "1", "--wait", "100", "--pings", "2", "--mcap", self.path("mcap"))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("no poses will be recorded: the service at tcp 127.0.0.1:14770 does not answer as sonard's control stream "
                      "(no greeting within 1 s)", done.stderr)


class Inside(Files):
    """sonard writes the file itself."""

    def steer(self, *words):
        return run(SONARCTL, *words, "--control", f"{self.daemon.address}:14770")

    def recording(self):
        return json.loads(self.steer("status", "--json").stdout)["recordings"][0]

    def test_a_full_disk_ends_the_recording_and_no_client_notices(self):
        with Sonard(scene="tank-rod.yaml", more="recording: {folder: .}\n") as self.daemon:
            kept = pathlib.Path(self.daemon.folder.name) / "run.mcap"
            done = self.steer("recording", "start", "run.mcap")
            self.assertEqual((done.returncode, done.stdout), (0, "recording to run.mcap; sonarctl status shows its progress\n"))
            for name, code in (("run.mcap", 65), ("../run.mcap", 65), ("run.txt", 65)):
                self.assertEqual(self.steer("recording", "start", name).returncode, code, name)
            resource.prlimit(self.daemon.process.pid, resource.RLIMIT_FSIZE, (2_500_000, 2_500_000))
            with Client(self.daemon.address) as client:
                client.send(fire_message(range_=1, flags=0x09))
                numbers = [client.ping().id]
                self.assertTrue(self.recording()["running"])
                deadline = time.monotonic() + 100
                while self.recording()["running"] and time.monotonic() < deadline:
                    numbers += [client.ping().id for _ in range(4)]
                numbers += [client.ping().id for _ in range(4)]
            figures = json.loads(self.steer("status", "--json").stdout)["sonars"][0]["figures"]
            missing = numbers[-1] - numbers[0] + 1 - len(numbers)  # not 0 if this test reads too slowly
            self.assertLessEqual(missing, int(figures.get("dropped", 0)))
            self.assertEqual(numbers, sorted(set(numbers)))
            self.assertIn("File too large", self.recording()["why"])
            self.assertIn(f"recording {kept}  of front: ", self.steer("status").stdout)
            self.assertRegex(self.steer("recording", "stop").stderr, "^sonarctl: sonard refused: nothing is being recorded; .* has ended: .*File too large")
            self.assertEqual(self.daemon.stop()[0], 0)
            self.assertEqual(self.daemon.log().count("recording stopped: cannot write more to"), 1)
            self.assertNotIn("recording ended", self.daemon.log())
            done = run(SONARCTL, "record", "--from", kept, "--raw", self.path("raw"))
            self.assertIn(done.returncode, (0, 65), done.stderr)
            self.assertGreater(len(split(self.read("raw"))), 3)

    def test_labels_are_recorded_on_request(self):
        with Sonard(mount="{frame: FRD, rpy_deg: [0, -15, 0]}", more="recording: {folder: .}\n") as self.daemon:
            self.assertEqual(self.steer("recording", "start", "run.raw", "--labels").returncode, 65)
            self.assertEqual(self.steer("recording", "start", "run.mcap", "--labels").returncode, 0)
            with Client(self.daemon.address) as client:
                client.send(fire_message(range_=8, flags=0x09))
                for _ in range(3):
                    client.ping()
            self.assertEqual(self.steer("recording", "stop").returncode, 0)
            checked = mcap_checker.check((pathlib.Path(self.daemon.folder.name) / "run.mcap").read_bytes())
        truths = checked.read("/front/truth")
        images, labels, shares, casters, instances = (
            checked.read(f"/front/{topic}") for topic in ("image", "labels", "share", "caster", "instances"))
        self.assertGreaterEqual(len(labels), 3)
        for image, label, share, caster, named, truth in zip(images, labels, shares, casters, instances, truths, strict=True):
            shape = [image[key] for key in ("width", "height", "timestamp")]
            for picture, encoding in ((label, "mono16"), (share, "mono8"), (caster, "mono16")):
                self.assertEqual([picture[key] for key in ("width", "height", "timestamp")], shape)
                self.assertEqual(picture["encoding"], encoding)
            samples = shape[0] * shape[1]
            label, caster = (struct.unpack(f"<{samples}H", picture["data"]) for picture in (label, caster))
            self.assertFalse(any(a and b for a, b in zip(label, caster, strict=True)))
            self.assertTrue(all(a or not b for a, b in zip(label, share["data"], strict=True)))
            self.assertEqual({one["instance"] for one in named["instances"]}, (set(label) | set(caster)) - {0})
            self.assertEqual(named["ping"], truth["ping"])
            names = {one["index"] + 1: one["name"] for one in truth["objects"]}
            for one in named["instances"]:
                self.assertEqual(one["name"], names.get(one["instance"], one["name"]))
            met = {index + 1 for index in truth["object"] if index >= 0}
            self.assertTrue(met & set(label), "an object that a beam meets first has samples")

    def test_recordings_are_made_only_in_the_configured_folder(self):
        with Sonard(scene="tank-rod.yaml") as self.daemon:
            done = self.steer("recording", "start", "run.mcap")
            self.assertEqual(done.returncode, 65)
            self.assertIn("recording: {folder: DIR}", done.stderr)


class OneIntoAnother(Files):
    """Converts recordings to recordings, without a sonar."""

    def made(self, pings=4, rows=40):
        body = struct.pack("<BBBBBdddd", 2, 0, 255, 127, 9, 1.0, 50.0, 0.0, 0.0)
        stream = b""
        for number in range(pings):
            image = bytes((number + i) % 255 for i in range(256 * rows))
            fixed = struct.pack("<IIddddIBdHHIII", number + 1, 0, 2.1e6, 15.0, 1.2, 1500.0, 0, 0, 0.01, rows, 256, 2048, len(image),
                                2048 + len(image))
            bearings = struct.pack("<256h", *range(-6400, 6400, 50))  # hundredths of a degree
            message = HEADER.pack(0x4F53, 7001, 0, 0x23, 0, 2032 + len(image), 0) + body + fixed + bearings
            stream += message + bytes(2048 - len(message)) + image
        return stream

    def convert(self, source, *arguments, **options):
        return run(SONARCTL, "record", "--from", source, *arguments, **options)

    def test_every_kind_is_converted_into_every_kind(self):
        self.path("raw").write_bytes(self.made())
        self.assertEqual(self.convert(self.path("raw"), *self.outputs(["pcap", "mcap", "oculus"])).returncode, 0)
        for kind in KINDS:
            out = self.folder / f"from-{kind}.raw"
            done = self.convert(self.path(kind), "--raw", out)
            self.assertEqual((done.returncode, out.read_bytes() == self.read("raw")), (0, True), done.stderr)
        self.assertEqual(oculus_log_messages(self.read("oculus")), split(self.made()))
        mcap_checker.check(self.read("mcap"))

    def test_mcap_files_with_json_pictures_are_read(self):
        kept = SEEDS / "mcap/with_truth.mcap"
        sent = [data for topic, _, data in mcap_checker.check(kept.read_bytes()).messages if topic == "/s/device"]
        done = self.convert(kept, "--raw", self.path("raw"), "--mcap", self.path("mcap"))
        self.assertEqual((done.returncode, self.read("raw")), (0, b"".join(sent)), done.stderr)
        old, new = (mcap_checker.check(path.read_bytes()).read(topic)[0]
                    for path, topic in ((kept, "/s/image"), (self.path("mcap"), "/sonar/image")))
        self.assertEqual(base64.b64decode(old["data"]), new["data"])

    def test_a_damaged_file_gives_its_readable_part(self):
        self.path("raw").write_bytes(self.made()[:-100])
        done = self.convert(self.path("raw"), "--oculus", self.path("oculus"))
        self.assertEqual(done.returncode, 65)
        self.assertIn("within a message: only", done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1)
        self.assertEqual(oculus_log_messages(self.read("oculus")), split(self.made(3)))
        with Replay(self.path("raw"), "--stepped") as replay:
            self.assertEqual(replay.everything(), self.made(3))
            self.assertEqual(replay.process.wait(60), 0)
            self.assertIn("within a message: only", replay.text())

    def test_a_signal_ends_a_replay(self):
        self.path("raw").write_bytes(self.made())
        for with_driver in (False, True):
            with Replay(self.path("raw"), "--loop") as replay:
                with socket.create_connection((replay.address, 52100), timeout=60) as driver:
                    driver.recv(1)
                    if not with_driver:
                        driver.close()
                        replay.wait_for("client left")
                    replay.process.send_signal(signal.SIGTERM)
                    self.assertEqual(replay.process.wait(30), 0, replay.text())
                self.assertIn("served ", replay.text())

    def test_a_full_disk_ends_a_conversion_with_one_sentence(self):
        def small_disk():
            resource.setrlimit(resource.RLIMIT_FSIZE, (1_500_000, 1_500_000))

        self.path("raw").write_bytes(self.made(pings=12, rows=700))
        for kind in ("pcap", "mcap", "oculus"):
            done = subprocess.run([str(SONARCTL), "record", "--from", str(self.path("raw")), f"--{kind}", str(self.path(kind))],
                                  preexec_fn=small_disk, capture_output=True, text=True, timeout=60, check=False)
            self.assertEqual(done.returncode, 74, done.stdout + done.stderr)
            self.assertRegex(done.stderr, r"^sonarctl: cannot write more to .*: File too large; its first \d+ bytes are whole\n$")
            out = self.folder / "rest.raw"
            self.assertEqual(self.convert(self.path(kind), "--raw", out).returncode, 0)
            kept = out.read_bytes()
            self.assertTrue(kept and self.read("raw").startswith(kept), kind)
        mcap_checker.check(self.read("mcap"))  # its end could be written

    def test_captured_pings_are_converted(self):
        folder = pathlib.Path(os.environ.get("SONARD_CAPTURES", self.folder))
        found = [p for p in (folder / "three_pings_8bit.raw", folder / "oculus/three_pings_8bit.raw") if p.exists()]
        if not found:
            self.skipTest("SONARD_CAPTURES names no folder with three_pings_8bit.raw")
        self.assertEqual(self.convert(found[0], *self.outputs(["pcap", "mcap", "oculus"])).returncode, 0)
        for path in (found[0], *map(self.path, ["pcap", "mcap", "oculus"])):
            with self.subTest(path.name), Replay(path, "--stepped") as replay:
                self.assertEqual(replay.everything(), found[0].read_bytes())

    def test_a_pipe_without_a_reader_is_refused_without_waiting(self):
        source = self.path("raw")
        source.write_bytes(self.made())
        os.mkfifo(self.folder / "pipe")
        for words in (["record", "--from", source, "--raw"], ["record", "--from", source, "--pcap"], ["view", "--from", source, "--png"]):
            done = run(SONARCTL, *words, self.folder / "pipe", patience_s=60)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (74, 1), done.stderr)
            self.assertIn("pipe: it is a pipe that no program reads; start its reader first", done.stderr)
        with subprocess.Popen(["cat", self.folder / "pipe"], stdout=subprocess.PIPE) as reader:
            eventually(lambda: run(SONARCTL, "record", "--from", source, "--raw", self.folder / "pipe").returncode == 0)
            self.assertEqual(reader.communicate()[0], source.read_bytes())

    def test_junk_in_a_raw_dump_is_reported(self):
        sound = self.made()
        junk = self.folder / "junk.raw"
        junk.write_bytes(sound + b"what is this?" + sound)
        done = self.convert(junk, "--mcap", self.path("mcap"), "--pcap", self.path("pcap"))
        junk_note = f"junk.raw: 13 bytes from byte {len(sound)} on belong to no message"
        self.assertEqual(done.returncode, 65)
        self.assertIn(junk_note, done.stderr)
        for kind, place in (("mcap", "the record at byte "), ("pcap", "packet ")):  # these still have the junk
            done = self.convert(self.path(kind), "--raw", self.folder / f"again-{kind}.raw")
            self.assertEqual(done.returncode, 65)
            self.assertIn(f": 13 bytes from {place}", done.stderr)
            self.assertEqual((self.folder / f"again-{kind}.raw").read_bytes(), junk.read_bytes())
        for number, words in ((3, ""), (4, f"sonarctl: {self.folder}/{junk_note}; the ping is from the undamaged part\n")):
            done = run(SONARCTL, "view", "--from", junk, "--ping", str(number), "--png", self.folder / "a.png")
            self.assertEqual((done.returncode, done.stderr), (0, words))
        junk.write_bytes(sound[:16] + b"nothing but junk" * 9)
        for words in (["view", "--from", junk, "--png", self.folder / "b.png"], ["record", "--from", junk, "--pcap", self.path("pcap")]):
            done = run(SONARCTL, *words)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (65, 1), done.stderr)

    def test_wrong_commands_are_refused(self):
        self.path("raw").write_bytes(b"nothing of the kind")
        done = run(SONARCTL, "record", self.path("raw"), "--mcap", self.path("mcap"))
        self.assertEqual((done.returncode, done.stderr.count("\n")), (64, 1), done.stderr)
        self.assertIn("is a file, not the address of a sonar: view, stats and record read a recording with --from FILE", done.stderr)
        for code, words in [(64, ["record", "127.0.0.2"]), (66, ["record", "--from", self.folder / "none", "--raw", "x"]),
                            (65, ["record", "--from", self.path("raw"), "--oculus", self.path("oculus")]),
                            (64, ["record", "--from", self.path("raw"), "--raw", self.path("raw")])]:
            done = run(SONARCTL, *words)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (code, 1), done.stderr)
        self.assertEqual(self.read("raw"), b"nothing of the kind")
        once, again = self.folder / "w", self.folder / "sub/../w"  # the same file for two kinds
        done = run(SONARCTL, "record", "--raw", once, "--oculus", again)
        self.assertEqual((done.returncode, done.stderr.count("\n")), (64, 1), done.stderr)
        self.assertIn("named for two kinds of files", done.stderr)
        self.assertFalse(once.exists())
        done = self.convert(SEEDS / "aris_file/two.aris", "--oculus", self.path("oculus"))
        self.assertEqual((done.returncode, self.path("oculus").exists()), (64, False))
        self.assertIn("such files do not hold the messages of an ARIS", done.stderr)
        for code, words in [(66, [self.folder / "none"]), (65, [self.path("raw")]), (64, [self.path("raw"), "--ip", "nowhere"]),
                            (64, [self.path("raw"), "--ip", "224.0.0.1"]), (64, [self.path("raw"), "--http", "255.255.255.255:1"])]:
            done = run(SONARD, "replay", *words)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (code, 1), done.stderr)


class Checker(unittest.TestCase):
    def test_the_checker_finds_wrong_bytes(self):
        for name in ("conversation", "with_truth"):
            sound = (SEEDS / f"mcap/{name}.mcap").read_bytes()
            mcap_checker.check(sound)
            for place in range(0, len(sound), 3):
                damaged = bytearray(sound)
                damaged[place] ^= 0x41
                with self.assertRaises(mcap_checker.Broken, msg=f"byte {place}"):
                    mcap_checker.check(damaged)


if __name__ == "__main__":
    unittest.main()
