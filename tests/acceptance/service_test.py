"""Tests the systemd unit: it is valid, its exposure is at most 1.5, and sonard needs nothing that it forbids. Needs no service
manager."""
import ctypes
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

from running_sonard import BUILD, ROOT, SONARCTL, SONARD, run

sys.path.insert(0, str(ROOT / "tests/reliability"))
from record import record  # noqa: E402  the folder above

UNIT = ROOT / "daemon/systemd/sonard.service"
MOST_EXPOSURE = 1.5
PR_SET_MDWE, PR_MDWE_REFUSE_EXEC_GAIN = 65, 1
NEEDS_SYSTEMD = unittest.skipIf(shutil.which("systemd-analyze") is None, "systemd-analyze is not here")


def settings():
    """Returns key -> values in their order; repeated keys add up."""
    found = {}
    for line in UNIT.read_text(encoding="utf-8").splitlines():
        match = re.match(r"(\w+)=(.*)", line)
        if match:
            found.setdefault(match.group(1), []).append(match.group(2))
    return found


def calls_of(set_name, seen=()):
    """Returns the system calls of a set such as @system-service, including those of nested sets."""
    calls = set()
    for line in run("systemd-analyze", "syscall-filter", set_name).stdout.splitlines():
        name = line.strip()
        if not name or name.startswith("#") or name == set_name:
            continue
        calls |= (calls_of(name, (*seen, set_name)) if name not in seen else set()) if name.startswith("@") else {name}
    return calls


class Unit(unittest.TestCase):
    def setUp(self):
        self.file = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory())) / "sonard.service"
        text = UNIT.read_text(encoding="utf-8")
        self.assertIn("ExecStart=sonard run\n", text)
        self.file.write_text(text.replace("ExecStart=sonard", f"ExecStart={SONARD.resolve()}"), encoding="utf-8")

    @NEEDS_SYSTEMD
    def test_it_is_valid(self):
        result = run("systemd-analyze", "verify", "--man=no", self.file)
        ours = [line for line in (result.stdout + result.stderr).splitlines() if "sonard" in line]
        self.assertEqual((result.returncode, ours), (0, []))

    @NEEDS_SYSTEMD
    def test_the_drop_ins_of_the_manual_are_valid(self):
        text = (ROOT / "docs/operations.md").read_text(encoding="utf-8").split("Changes go in a drop-in", 1)[1]
        drop_ins = re.findall(r"^    \[Service\]\n(?:    \S.*\n)+", text, re.MULTILINE)
        self.assertEqual(len(drop_ins), text.count("[Service]"))
        base = self.file.read_text(encoding="utf-8")
        for drop_in in drop_ins:
            own = drop_in.replace("ExecStart=sonard", f"ExecStart={SONARD.resolve()}")
            # A program that is not installed here is not a mistake of the drop-in.
            own = re.sub(r"ExecStartPre=.*", "ExecStartPre=/bin/true", own)
            self.file.write_text(base + "\n" + re.sub("^    ", "", own, flags=re.MULTILINE), encoding="utf-8")
            result = run("systemd-analyze", "verify", "--man=no", self.file)
            ours = [line for line in (result.stdout + result.stderr).splitlines() if "sonard" in line]
            self.assertEqual((result.returncode, ours), (0, []), drop_in)

    @NEEDS_SYSTEMD
    def test_its_exposure_is_at_most_one_and_a_half(self):
        result = run("systemd-analyze", "security", "--offline=true", "--no-pager", self.file)
        match = re.search(r"Overall exposure level for \S+: ([\d.]+)", result.stdout)
        self.assertTrue(match, result.stdout + result.stderr)
        exposure = float(match.group(1))
        record("unit-exposure", f"{exposure:.1f}", f"at most {MOST_EXPOSURE}", exposure <= MOST_EXPOSURE,
               "python3 tests/acceptance/service_test.py")
        self.assertLessEqual(exposure, MOST_EXPOSURE, result.stdout)

    def test_mistakes_cause_no_restart_and_a_hangup_reloads(self):
        there = settings()
        self.assertEqual(there["RestartPreventExitStatus"], ["64 65 66 78"])
        self.assertEqual((there["Type"], there["ExecReload"]), (["notify"], ["kill -HUP $MAINPID"]))
        self.assertIn("WatchdogSec", there)

    @NEEDS_SYSTEMD
    @unittest.skipIf(shutil.which("strace") is None, "strace is not here")
    def test_sonard_makes_no_system_call_that_the_unit_refuses(self):
        """Traces a rendered picture, and a daemon that serves three pings to a client, with strace."""
        if "SONAR_SANITIZE:STRING=\n" not in (BUILD / "CMakeCache.txt").read_text(encoding="utf-8"):
            self.skipTest("sanitizers make calls of their own")
        allowed = set()
        for value in settings()["SystemCallFilter"]:
            names = value.lstrip("~").split()
            named = set().union(*(calls_of(n) if n.startswith("@") else {n} for n in names))
            allowed = allowed - named if value.startswith("~") else allowed | named
        self.assertIn("setpriority", allowed)
        self.assertNotIn("chown", allowed)
        with tempfile.TemporaryDirectory() as folder:
            counts = pathlib.Path(folder) / "calls"
            probe = run("strace", "-o", "/dev/null", "true")
            if probe.returncode != 0:
                self.skipTest(f"strace may not trace: {probe.stderr.strip()}")
            picture = run("strace", "-f", "-qq", "-o", counts, SONARD, "render", ROOT / "scenes/sonard.yaml", "--out", folder, "--quiet")
            self.assertEqual(picture.returncode, 0, picture.stderr)
            served = self.serve_under_strace(pathlib.Path(folder))
            text = counts.read_text(encoding="utf-8", errors="replace") + served
        used = set(re.findall(r"^\d+ +(\w+)\(", text, re.M))
        self.assertIn("accept4" if "accept4" in used else "accept", used, "the trace contains the calls of serving a client")
        self.assertEqual(sorted(used - allowed - {"execve"}), [])

    def serve_under_strace(self, folder):
        address, calls = "127.0.0.9", folder / "served"
        config = folder / "sonard.yaml"
        config.write_text("world: {scene: demo.yaml}\nvehicles: [{name: rov, initial_pose: {frame: ENU_FLU, xyz_m: [-7, 0, -3]}}]\n"
                          f"sonars: [{{name: a, profile: oculus-m1200d, bind_ip: {address}, status_to: [{address}]}}]\n"
                          f'poses: {{protobuf: "{address}:14770", json: "{address}:14771"}}\n', encoding="utf-8")
        with subprocess.Popen(["strace", "-f", "-qq", "-o", str(calls), str(SONARD), "run", str(config), "--exit-after-pings", "3"],
                              stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
            listened = run(SONARCTL, "listen", address, "--pings", "3", "--wait", "150", "--seconds", "150", "--quiet", patience_s=360)
            if listened.returncode != 0:  # sonard still waits for a reader of its pings
                subprocess.run(["pkill", "-P", str(process.pid)], check=False)
            try:
                said = process.communicate(timeout=120)[1].decode(errors="replace")
            except subprocess.TimeoutExpired:
                subprocess.run(["pkill", "-KILL", "-P", str(process.pid)], check=False)
                process.kill()
                said = f"sonard did not end; {process.communicate()[1].decode(errors='replace')}"
        traced = calls.read_text(encoding="utf-8", errors="replace")
        self.assertEqual((process.returncode, listened.returncode), (0, 0), f"{listened.stderr}\n{said}\n{traced[-3000:]}")
        return traced

    def test_memory_that_is_written_is_never_executed(self):
        """Sets MemoryDenyWriteExecute= with the switch of the kernel; Embree and all other code must work with it."""
        libc = ctypes.CDLL(None, use_errno=True)
        if not self.refuses_memory(libc):
            self.skipTest("this kernel has no PR_SET_MDWE")
        with tempfile.TemporaryDirectory() as folder:
            result = subprocess.run([str(SONARD), "render", str(ROOT / "scenes/sonard.yaml"), "--out", folder, "--quiet"],
                                    stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120, check=False,
                                    preexec_fn=lambda: libc.prctl(PR_SET_MDWE, PR_MDWE_REFUSE_EXEC_GAIN, 0, 0, 0))
        self.assertEqual(result.returncode, 0, result.stderr)

    @staticmethod
    def refuses_memory(libc):
        """Returns whether the kernel has the switch, which is set in a child process, because it cannot be undone."""
        child = os.fork()
        if child == 0:
            os._exit(0 if libc.prctl(PR_SET_MDWE, PR_MDWE_REFUSE_EXEC_GAIN, 0, 0, 0) == 0 else 1)
        return os.waitpid(child, 0)[1] == 0


if __name__ == "__main__":
    unittest.main()
