"""Tests data sets, their exports and the farm on a full disk, a small tmpfs. The command names the file and the remedy, and ends
with exit code 74. A half-written file does not count as finished. With more room the same command completes the same bytes."""
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import unittest

from running_sonard import ROOT, SONARD, SONARCTL, eventually, run

PORT = 4223
URL = f"nats://127.0.0.1:{PORT}"
SERVER = shutil.which("nats-server") or shutil.which("nats-server", path="/usr/sbin:/usr/local/sbin")
ENTERED = "SONARD_TEST_HAS_MOUNTS"  # this program runs again in a mount namespace of its own


def why_not():
    if os.environ.get(ENTERED) is None:
        return "no mount namespace can be made here"
    return ""


def small_job(pings, shard):
    mines = (ROOT / "scenes/datasets/mines.yaml").read_text(encoding="utf-8")
    text = re.sub(r"pings: \d+, shard: \d+", f"pings: {pings}, shard: {shard}", mines)
    return text.replace("beams: 256, rows: 400", "beams: 64, rows: 100")


def bytes_of(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@unittest.skipIf(why_not(), why_not())
class FullDisk(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.path = pathlib.Path(cls.folder.name)
        cls.job = cls.path / "small.yaml"
        cls.job.write_text(small_job(6, 2), encoding="utf-8")
        cls.whole = cls.path / "whole"
        done = run(SONARD, "dataset", cls.job, "--out", cls.whole, "--quiet", "--export", "coco")
        assert done.returncode == 0, done.stderr
        cls.wanted = bytes_of(cls.whole)

    def setUp(self):
        self.disk = self.path / "disk"
        self.disk.mkdir(exist_ok=True)

    def tearDown(self):
        subprocess.run(["umount", "-l", str(self.disk)], check=False, stderr=subprocess.DEVNULL)

    def mount(self, options):
        subprocess.run(["umount", "-l", str(self.disk)], check=False, stderr=subprocess.DEVNULL)
        subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(self.disk)], check=True)

    def make_room(self):
        subprocess.run(["mount", "-o", "remount,size=64m,nr_inodes=10000", str(self.disk)], check=True)

    def expect_refusal(self, done):
        """Checks that the program ended with one sentence that names a file on the disk and what to do."""
        self.assertEqual(done.returncode, 74, done.stdout + done.stderr)
        told = done.stderr.strip().splitlines()[-1]
        self.assertRegex(told, rf"cannot (write|make the folder) {re.escape(str(self.disk))}/\S*: No space left on device; "
                               r"(make room|choose another --out)")
        return told

    def make(self):
        return run(SONARD, "dataset", self.job, "--out", self.disk / "set", "--quiet", "--export", "coco")

    def sizes(self):
        """Returns sizes of disks as options of mount, from almost no room to just too little."""
        whole = sum((len(b) + 4095) // 4096 * 4096 for b in self.wanted.values())
        some = [f"size={max(4096, whole * part // 8)},nr_inodes=10000" for part in (0, 1, 2, 3, 5, 6, 7)]
        return some + [f"size=64m,nr_inodes={n}" for n in (2, 4, 7, 12, 17)]

    def test_a_data_set_and_its_export(self):
        refused = 0
        for options in self.sizes():
            with self.subTest(options):
                self.mount(options)
                done = self.make()
                if done.returncode != 0:
                    self.expect_refusal(done)
                    refused += 1
                    there = bytes_of(self.disk)
                    self.assertFalse((self.disk / "set/coco").exists())
                    for name, contents in there.items():  # files with their final names are complete
                        if name.startswith("set/") and ".tmp" not in name and ".unfinished" not in name:
                            self.assertEqual(contents, self.wanted[name[len("set/"):]], name)
                self.make_room()
                done = self.make()
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual(bytes_of(self.disk / "set"), self.wanted)
        self.assertGreater(refused, 8)

    def fill(self, left):
        """Fills the disk up to this number of free bytes."""
        filler = self.disk / "filler"
        with open(filler, "wb") as file:
            file.truncate(0)
            free = os.statvfs(self.disk)
            os.posix_fallocate(file.fileno(), 0, free.f_bavail * free.f_bsize - left)
        return filler

    @staticmethod
    def server_answers():
        with socket.socket() as s:
            return s.connect_ex(("127.0.0.1", PORT)) == 0

    @unittest.skipIf(SERVER is None, "needs nats-server")
    def test_the_farm(self):
        self.mount("size=64m")
        server = subprocess.Popen([SERVER, "-js", "-sd", str(self.path / "store"), "-a", "127.0.0.1", "-p", str(PORT)],
                                  stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(server.wait)
        self.addCleanup(server.kill)
        eventually(self.server_answers)
        out = self.disk / "farm"
        submit = (SONARCTL, "farm", "submit", self.job, "--nats", URL, "--out", out, "--ack-wait", "3")
        worker = (SONARD, "worker", "--nats", URL, "--out", out, "--threads", "1", "--until-empty")
        filler = self.fill(0)
        done = run(*submit)
        if "built without the farm" in done.stderr:
            self.skipTest("this sonard was built without the farm")
        self.expect_refusal(done)
        filler.unlink()
        done = run(*submit)
        self.assertEqual(done.returncode, 0, done.stderr)
        folder = out / done.stdout.split()[0]

        filler = self.fill(16 << 10)  # less than a shard
        self.expect_refusal(run(*worker))
        self.assertEqual(list(folder.glob("shard-*")), [])
        self.assertIn("3 shards: 0 done", run(SONARCTL, "farm", "status", "--nats", URL).stdout)
        filler.unlink()
        done = run(*worker)
        self.assertEqual(done.returncode, 0, done.stderr)

        filler = self.fill(0)
        self.expect_refusal(run(SONARCTL, "farm", "collect", folder))
        self.assertFalse((folder / "manifest.json").exists())
        filler.unlink()
        done = run(SONARCTL, "farm", "collect", folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual({n: b for n, b in bytes_of(folder).items() if n.startswith("shard-")},
                         {n: b for n, b in self.wanted.items() if n.startswith("shard-")})

    def test_a_limit_of_file_sizes_is_a_full_disk(self):
        out = self.path / "limited"
        limited = subprocess.run(["sh", "-c", 'ulimit -f 8 && exec "$@"', "sh", SONARD, "dataset", self.job, "--out", out, "--quiet"],
                                 stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120, check=False)
        self.assertEqual(limited.returncode, 74, limited.stderr)
        self.assertIn(f"cannot write {out}/shard-000000.tar: File too large; make room", limited.stderr)
        done = run(SONARD, "dataset", self.job, "--out", out, "--quiet", "--export", "coco")
        self.assertEqual((done.returncode, bytes_of(out)), (0, self.wanted), done.stderr)


if __name__ == "__main__":
    if ENTERED not in os.environ and subprocess.run(["unshare", "-rm", "true"], check=False, stderr=subprocess.DEVNULL).returncode == 0:
        os.environ[ENTERED] = "yes"
        os.execvp("unshare", ["unshare", "-rm", sys.executable, "-B", *sys.argv])
    unittest.main()
