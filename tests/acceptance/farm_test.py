"""Tests the farm with a real NATS server on loopback: a worker and the server are killed, a shard always fails, an alarm is raised."""
import json
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import unittest

from running_sonard import ROOT, SONARD, SONARCTL, eventually, run

PORT = 4222
URL = f"nats://127.0.0.1:{PORT}"

sys.path.append(str(ROOT / "tests/reliability"))
from record import record  # noqa: E402  pylint: disable=wrong-import-position

SERVER = shutil.which("nats-server") or shutil.which("nats-server", path="/usr/sbin:/usr/local/sbin")

SMALL = """\
dataset: {pings: 12, shard: 2}
vary: {x: {list: [4, 4.2, 4.4, 4.6, 4.8, 5, 5.2, 5.4, 5.6, 5.8, 6, 6.2]}}
constraints: {in_view: [ball], tries: 2}
scene:
  objects:
    - {name: bed, type: plane, material: sand, size_m: [20, 20], pose: {xyz_m: [5, 0, -12]}}
    - {name: ball, label: ball, type: mesh, file: meshes/ball.obj, material: steel, pose: {xyz_m: [$x, 0, -11]}}
sonar: {ping: {range_m: 7, beams: 32, rows: 64}}
poses: {at: {frame: ENU_FLU, xyz_m: [0, 0, -10.5], rpy_deg: [0, 10, 0]}}
"""
TETRAHEDRON = "v 0 0 0.3\nv 0.3 0 -0.2\nv -0.2 0.3 -0.2\nv -0.2 -0.3 -0.2\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n"


def why_not():
    if "built without the farm" in run(SONARD, "farm", "status").stderr:
        return "this sonard was built without the farm"
    return "" if SERVER else "needs nats-server"


WHY_NOT = why_not()


@unittest.skipIf(WHY_NOT, WHY_NOT)
class Farm(unittest.TestCase):
    def setUp(self):
        self.path = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.out = self.path / "farm"
        self.processes = []
        self.addCleanup(self.end_all)
        self.start_server()

    def end_all(self):
        for process in self.processes:
            process.kill()
            process.wait()

    def start(self, *command):
        log = open(self.path / f"log{len(self.processes)}", "w", encoding="utf-8")  # pylint: disable=consider-using-with
        self.addCleanup(log.close)
        process = subprocess.Popen([str(c) for c in command], stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        self.processes.append(process)
        return process

    def start_server(self):
        self.server = self.start(SERVER, "-js", "-sd", self.path / "store", "-a", "127.0.0.1", "-p", PORT)
        eventually(self.answers)

    def answers(self):
        with socket.socket() as s:
            return s.connect_ex(("127.0.0.1", PORT)) == 0

    def worker(self, out=None, *more):
        return self.start(SONARD, "worker", "--nats", URL, "--out", out or self.out, "--threads", "1", *more)

    def farm(self, *words, code=0):
        result = run(SONARCTL, "farm", *words)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result.stdout + result.stderr

    def status(self):
        return self.farm("status", "--nats", URL)

    def submit(self, job, *more):
        text = self.farm("submit", job, "--nats", URL, "--out", self.out, "--ack-wait", "3", *more)
        return text, self.out / text.split()[0]

    def logs(self):
        return "\n".join(p.read_text(encoding="utf-8", errors="replace") for p in sorted(self.path.glob("log*")))

    def small_job(self, text=SMALL):
        folder = self.path / "job"
        (folder / "meshes").mkdir(parents=True)
        (folder / "meshes/ball.obj").write_text(TETRAHEDRON)
        (folder / "small.yaml").write_text(text)
        return folder / "small.yaml"

    def wait_for(self, *processes):
        for process in processes:
            self.assertEqual(process.wait(timeout=200), 0, self.logs())

    def test_three_workers_make_what_one_process_makes_though_one_and_the_server_are_killed(self):
        job = self.path / "mines.yaml"
        mines = (ROOT / "scenes/datasets/mines.yaml").read_text(encoding="utf-8")
        job.write_text(re.sub(r"pings: \d+, shard: \d+", "pings: 24, shard: 2", mines).replace("beams: 256, rows: 400", "beams: 64, rows: 200"))
        whole = self.path / "whole"
        self.assertEqual(run(SONARD, "dataset", job, "--out", whole, "--quiet", patience_s=300).returncode, 0)
        text, made = self.submit(job)
        self.assertIn("12 shards: 12 submitted, 0 in the queue already", text)
        self.assertIn("0 submitted, 12 in the queue already", self.submit(job)[0])
        self.assertRegex(self.farm("collect", made, code=65), "12 of 12 shards are missing: shard-000000.tar, shard-000001.tar")
        workers = [self.worker(None, "--until-empty") for _ in range(3)]
        victim = workers.pop()
        eventually(lambda: list(made.glob(f"shard-*.tar.tmp.*.{victim.pid}")) or list(made.glob("shard-*.tar.sha256"))[5:])
        victim.send_signal(signal.SIGKILL)
        eventually(lambda: list(made.glob("shard-*.tar.sha256")))
        self.server.kill()
        self.server.wait()
        self.start_server()
        self.wait_for(*workers)
        self.assertIn("12 done, 0 running, 0 queued, 0 dead", self.status(), self.logs())
        self.assertIn("12 shards as they were written", self.farm("collect", made))
        for file in whole.iterdir():
            if file.name != "job.json":
                self.assertEqual(file.read_bytes(), (made / file.name).read_bytes(), file.name)
        self.assertEqual(list(made.glob("*.tmp*")), [])
        record("farm-kill", "12 of 12, of 3 workers", "all, byte for byte those of one process", True, "python3 tests/acceptance/farm_test.py")
        self.assertIn("0 submitted, 0 in the queue already, 12 finished", self.submit(job)[0])
        (made / "shard-000003.tar").unlink()
        self.assertIn("1 submitted", self.submit(job)[0])  # although the server has just received its id
        self.wait_for(self.worker(None, "--until-empty"))
        self.assertIn("as they were written", self.farm("collect", made))

    def test_a_shard_that_always_fails_is_listed_as_dead_and_the_rest_is_complete(self):
        _, made = self.submit(self.small_job(SMALL.replace("5, 5.2", "5, -50")))  # ping 7, in shard 3
        self.wait_for(self.worker(None, "--until-empty"), self.worker(None, "--until-empty"))
        status = self.status()
        self.assertIn("5 done, 0 running, 0 queued, 1 dead", status)
        self.assertRegex(status, "dead: shard 3: .*ping 7: no draw of 2 meets the constraints")
        self.assertRegex(self.farm("collect", made, code=65), "1 of 6 shards are missing: shard-000003.tar")
        self.assertEqual(self.logs().count("no draw of 2 meets"), 4)

    def test_files_are_sent_to_a_worker_with_a_folder_of_its_own(self):
        _, made = self.submit(self.small_job())
        own = self.path / "own"
        self.wait_for(self.worker(own, "--until-empty"))
        theirs = own / made.name
        self.assertIn("6 shards as they were written", self.farm("collect", theirs))
        self.assertEqual((theirs / "files/meshes/ball.obj").read_text(), TETRAHEDRON)
        self.assertEqual(len(json.loads((theirs / "manifest.json").read_text())["shards"]), 6)

    def test_a_worker_without_a_file_leaves_the_job_to_others(self):
        job = self.small_job(SMALL + "# more.obj\n")
        (job.parent / "more.obj").write_text(TETRAHEDRON * ((9 << 20) // len(TETRAHEDRON)))  # too large to be sent
        self.submit(job)
        worker = self.worker(self.path / "own")
        self.assertEqual(worker.wait(timeout=120), 69, self.logs())
        self.assertIn("start the worker with the same --out folder as", self.logs())
        self.assertIn("0 running, 6 queued, 0 dead", self.status())

    def test_unequal_bytes_of_a_shard_stop_the_job(self):
        _, made = self.submit(self.small_job())
        for name, text in (("tar", "other"), ("json", "{}"), ("tar.sha256", "00  shard-000002.tar\n")):
            (made / f"shard-000002.{name}").write_text(text)
        worker = self.worker()
        eventually(lambda: "STOPPED" in self.status())
        self.assertIn("shard-000002.tar differs", self.status())
        worker.terminate()
        self.wait_for(worker)
        self.assertIn("ALARM", self.logs())
        self.wait_for(self.worker(None, "--until-empty"))
        self.assertFalse((made / "shard-000005.tar").exists())

    def test_a_worker_that_is_ended_gives_its_shard_back(self):
        text = re.sub(r"shard: \d+", "shard: 100000", re.sub(r"pings: \d+", "pings: 100000", SMALL))
        _, made = self.submit(self.small_job(text))
        worker = self.worker()
        eventually(lambda: list(made.glob("*.tmp.*")))
        eventually(lambda: "shard-000000.tar" in self.status())
        worker.terminate()
        self.wait_for(worker)
        self.assertIn("0 running, 1 queued", self.status())

    def test_numbers_that_are_not_shards_are_removed_from_the_queue(self):
        with socket.create_connection(("127.0.0.1", PORT), timeout=60) as nats:
            lines = nats.makefile("rb")
            nats.sendall(b'CONNECT {"verbose":false}\r\nSUB farm.work.> 1\r\nPING\r\n')
            while not lines.readline().startswith(b"PONG"):
                pass
            _, made = self.submit(self.small_job())
            job = lines.readline().split(b".")[2]  # MSG farm.work.JOB.SHARD ...
            for number in (b"6", b"999999999", b"18446744073709551615", b"x"):
                nats.sendall(b"PUB farm.work." + job + b"." + number + b" 0\r\n\r\n")
            nats.sendall(b"PING\r\n")
            while not lines.readline().startswith(b"PONG"):
                pass
        self.wait_for(self.worker(None, "--until-empty"))
        for number in ("6", "999999999", "18446744073709551615"):
            self.assertIn(f"shard {number} is not one of the 6 of", self.logs())
        self.assertEqual(sorted(f.name for f in made.glob("shard-*.tar")), [f"shard-{n:06}.tar" for n in range(6)])
        self.assertIn("6 done, 0 running, 0 queued, 0 dead", self.status())
        record("farm-strays", "3 of 3 refused, 6 shards", "refused by name, no file made", True, "python3 tests/acceptance/farm_test.py")

    def test_mistakes_are_reported(self):
        job = self.small_job()
        outside = self.path / "outside.obj"
        outside.write_text(TETRAHEDRON)
        job.write_text(SMALL.replace("meshes/ball.obj", "../outside.obj"))
        self.assertIn("../outside.obj is outside the job's folder",
                      self.farm("submit", job, "--nats", URL, "--out", self.out, code=78))
        self.assertIn("the farm has no jobs", self.status())
        self.server.kill()
        self.server.wait()
        result = run(SONARCTL, "farm", "status", "--nats", URL)
        self.assertEqual((result.returncode, "no NATS server answers at" in result.stderr), (69, True), result.stderr)

    def test_a_worker_that_is_started_before_the_server_waits_for_it(self):
        self.submit(self.small_job())
        self.server.kill()
        self.server.wait()
        worker, stopped = self.worker(None, "--until-empty"), self.worker()
        eventually(lambda: self.logs().count("no NATS server answers at") >= 2)
        self.assertIn("trying again", self.logs())
        self.assertEqual((worker.poll(), stopped.poll()), (None, None), self.logs())
        stopped.terminate()
        self.wait_for(stopped)
        self.start_server()
        self.wait_for(worker)
        self.assertIn("6 done, 0 running", self.status())


if __name__ == "__main__":
    unittest.main()
