"""Runs sonard and sonarctl for the acceptance tests.

SONARD_BUILD names the build folder, build/release by default; ctest sets it.
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "clients/python"))

from sonard_client.daemon import Daemon  # noqa: E402  pylint: disable=wrong-import-position

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
    bind_ip: ADDRESS
    status_to: [ADDRESS]
poses: {{protobuf: "ADDRESS:14770", json: "ADDRESS:14771"{poses}}}
control: {{stream: "ADDRESS:14770", http: "{http}"{control}}}
{more}
"""


def run(*command, patience_s=300):
    return subprocess.run([str(c) for c in command], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=patience_s,
                          check=False)


def eventually(true, patience_s=120):
    """Waits until true() is true; returns its value."""
    end = time.monotonic() + patience_s
    while not (value := true()):
        if time.monotonic() > end:
            raise AssertionError(f"not true within {patience_s} s")
        time.sleep(0.02)
    return value


def expect_quiet(udp, for_s=1, patience_s=60):
    """Reads data in transit until nothing arrives for this time."""
    end = time.monotonic() + patience_s
    udp.settimeout(for_s)
    try:
        while time.monotonic() < end:
            udp.recv(65536)
    except TimeoutError:
        return
    raise AssertionError(f"datagrams arrive for {patience_s} s")


class Sonard(Daemon):
    """with Sonard(scene="demo.yaml") as daemon: ... daemon.address"""

    def __init__(self, scene="demo.yaml", profile="oculus-m1200d", pose="{frame: ENU_FLU, xyz_m: [-7, 0, -3]}",
                 mount="{frame: FLU, xyz_m: [0, 0, 0]}", trajectory="", more="", control="", http="", poses="",
                 arguments=()):
        super().__init__(CONFIG, str(SONARD), arguments)
        self.folder = self._folder = tempfile.TemporaryDirectory()
        self.scene, self.profile, self.pose, self.mount = ROOT / "scenes" / scene, profile, pose, mount
        self.trajectory = f", trajectory: {trajectory}" if trajectory else ""
        self.control = control  # further keys of that section, such as ", token_file: token"
        self.http = http  # empty: port 8088 of the address
        self.poses = poses  # further keys of that section
        self.more = more

    def write_config(self):
        self._text = CONFIG.format(scene=self.scene, profile=self.profile, pose=self.pose, mount=self.mount,
                                   trajectory=self.trajectory, more=self.more, control=self.control,
                                   http=self.http or "ADDRESS:8088", poses=self.poses)
        return super().write_config()

    def restart(self):
        """Starts sonard again with the same configuration, after its process has ended."""
        self._launch(self.process.args)
        if not self._ready():
            raise AssertionError(self.log())

    def ctl(self, command, *arguments, **options):
        """Runs sonarctl COMMAND ADDRESS ..."""
        waits = command in ("view", "stats") or "--pings" in arguments
        wait = ("--wait", 100) if waits and "--wait" not in arguments else ()  # for the first ping
        return run(SONARCTL, command, self.address, *arguments, *wait, **options)

    def status(self):
        """Returns the output of sonarctl status, over the control stream of this address."""
        return json.loads(run(SONARCTL, "status", "--json", "--control", f"{self.address}:14770").stdout)

    def get(self, path):
        """Returns the answer over HTTP."""
        with urllib.request.urlopen(f"http://{self.address}:8088{path}", timeout=60) as answer:
            return answer.read().decode()

    def ctl_to(self, endpoint, command, *arguments, **options):
        """Runs sonarctl COMMAND ... --to ENDPOINT, for poses."""
        return run(SONARCTL, command, *arguments, "--to", endpoint, **options)

    def stop(self, timeout_s=60):
        """Returns the exit code after SIGTERM, and the seconds until the end."""
        start = time.monotonic()
        return super().stop(timeout_s), time.monotonic() - start

    def wait(self, patience_s=300):
        return self.process.wait(patience_s)

    def __exit__(self, *_):
        """Kills the process, because a test may have suspended it."""
        if self._process is not None and self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        self.folder.cleanup()
