"""Starts the shipped sonard on an address of its own and stops it; runs the shipped sonarctl. Used by the acceptance tests.

SONARD_BUILD names the build folder, build/release by default; ctest sets it.
"""
import os
import pathlib
import random
import signal
import subprocess
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("SONARD_BUILD", ROOT / "build/release"))
SONARD, SONARCTL = BUILD / "daemon/sonard", BUILD / "clients/sonarctl"

CONFIG = """\
world: {{scene: {scene}, seed: 1}}
vehicles:
  - {{name: rov, initial_pose: {pose}{trajectory}}}
sonars:
  - name: front
    profile: {profile}
    mount: {mount}
    bind_ip: {address}
    status_to: [{address}]
poses: {{protobuf: "{address}:14770", json: "{address}:14771"{poses}}}
control: {{stream: "{address}:14770", http: "{http}"{control}}}
{more}
"""


def free_address():
    return f"127.{random.randint(64, 126)}.{random.randint(0, 255)}.{random.randint(1, 254)}"


def run(*command, patience_s=120):
    return subprocess.run([str(c) for c in command], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=patience_s,
                          check=False)


class Sonard:
    """with Sonard(scene="demo.yaml") as daemon: ... daemon.address"""

    def __init__(self, scene="demo.yaml", profile="oculus-m1200d", pose="{frame: ENU_FLU, xyz_m: [-7, 0, -3]}",
                 mount="{frame: FLU, xyz_m: [0, 0, 0]}", trajectory="", more="", control="", http="", poses="",
                 arguments=()):
        self.folder = tempfile.TemporaryDirectory()
        self.scene, self.profile, self.pose, self.mount = ROOT / "scenes" / scene, profile, pose, mount
        self.trajectory = f", trajectory: {trajectory}" if trajectory else ""
        self.control = control  # more of that section: ", token_file: token"
        self.http = http  # empty: port 8088 of the address
        self.poses = poses  # as control; ADDRESS in it becomes the daemon's
        self.more, self.arguments = more, [str(a) for a in arguments]

    def __enter__(self):
        for _ in range(5):
            self._start()
            if self._ready():
                return self
            code = self.process.wait()
            if code != 69:  # 69: the address is taken, another one may be free
                break
        text = self.log()
        self.folder.cleanup()
        raise AssertionError(f"sonard ended with code {code}:\n{text}")

    def _start(self):
        self.address = free_address()
        config = self.write_config()
        self.log_path = pathlib.Path(self.folder.name) / "log"
        with open(self.log_path, "wb") as log:
            self.process = subprocess.Popen([str(SONARD), "run", str(config), *self.arguments], stdin=subprocess.DEVNULL,
                                            stdout=log, stderr=subprocess.STDOUT)

    def write_config(self):
        """For self.address; returns where it is."""
        config = pathlib.Path(self.folder.name) / "sonard.yaml"
        config.write_text(CONFIG.format(address=self.address, scene=self.scene, profile=self.profile, pose=self.pose,
                                        mount=self.mount, trajectory=self.trajectory, more=self.more, control=self.control,
                                        http=self.http or f"{self.address}:8088",
                                        poses=self.poses.replace("ADDRESS", self.address)),
                          encoding="utf-8")
        return config

    def _ready(self, patience_s=60):
        deadline = time.monotonic() + patience_s
        while time.monotonic() < deadline:
            if "ready in" in self.log():
                return True
            if self.process.poll() is not None:
                return False
            time.sleep(0.01)
        self.process.kill()
        return False

    def log(self):
        return self.log_path.read_text(encoding="utf-8", errors="replace")

    def ctl(self, command, *arguments, **options):
        """sonarctl COMMAND ADDRESS ..."""
        return run(SONARCTL, command, self.address, *arguments, **options)

    def ctl_to(self, endpoint, command, *arguments, **options):
        """sonarctl COMMAND ... --to ENDPOINT, for poses."""
        return run(SONARCTL, command, *arguments, "--to", endpoint, **options)

    def stop(self, patience_s=20):
        """Exit code after SIGTERM, and the seconds it took."""
        start = time.monotonic()
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(patience_s), time.monotonic() - start

    def wait(self, patience_s=300):
        return self.process.wait(patience_s)

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self.folder.cleanup()
