"""Reads the live view with independent software: Foxglove's client library and schemas, protobuf.js, Lichtblick's ROS 2 reader.

npm installs them into the build folder, in the versions of view/node/package-lock.json. Skipped without npm or network."""
import contextlib
import hashlib
import json
import pathlib
import shutil
import socket
import subprocess
import sys
import threading
import time
import unittest

from oculus_reader import Client, Ping, fire_message
from running_sonard import BUILD, ROOT, Sonard, run

SOURCE, PLACE = pathlib.Path(__file__).parent / "view/node", BUILD / "tests/acceptance/view-node"
SCHEMAS = ROOT / "protocol/foxglove/schemas/foxglove.proto"
OURS = ("EUSAGE", "EINTEGRITY", "EJSONPARSE")  # npm's error codes for a wrong package.json or lock file


def install():
    """Returns the reason why the readers are missing; empty if they are installed."""
    for program in ("node", "npm"):
        if not shutil.which(program):
            return f"no {program}"
    lock, installed = SOURCE / "package-lock.json", PLACE / "installed-lock.json"
    shutil.copytree(SOURCE, PLACE, dirs_exist_ok=True)
    if installed.is_file() and installed.read_bytes() == lock.read_bytes():
        return ""
    command = ["npm", "ci", "--ignore-scripts", "--prefer-offline", "--fetch-retries=1", "--fetch-retry-mintimeout=1000",
               "--fetch-timeout=30000"]
    try:
        done = subprocess.run(command, cwd=PLACE, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=150, check=False)
    except subprocess.TimeoutExpired:
        return "npm took too long"
    if done.returncode != 0:
        assert not any(code in done.stderr for code in OURS), done.stderr
        return "npm cannot install: " + next((line for line in done.stderr.splitlines() if "code" in line), done.stderr[-200:])
    shutil.copy(lock, installed)
    return ""


WHY_NOT = install()
if sys.argv[1:] == ["--install"]:  # run by ctest where a network is available
    sys.exit(print(WHY_NOT))


def judge(what, where):
    done = run("node", PLACE / "judge.mjs", what, where, patience_s=400)
    if done.returncode != 0:
        raise AssertionError(f"{what}: {done.stderr}")
    return json.loads(done.stdout)


def url(daemon):
    return f"ws://{daemon.address}:8088/"


class Driver:
    """Receives pings until the end of the block."""

    def __init__(self, daemon):
        self.messages, self._client = [], Client(daemon.address)
        self._thread = threading.Thread(target=self._take)

    def __enter__(self):
        self._client.send(fire_message())
        self._thread.start()
        return self

    def _take(self):
        with contextlib.suppress(OSError, EOFError):
            while True:
                kind, message = self._client.message()
                if kind == 0x23:
                    self.messages.append(message)

    def sums(self):
        """Returns {ping number: SHA-256 of its samples}, for samples of 8 bits."""
        pings = [Ping(message) for message in self.messages]
        return {ping.id: hashlib.sha256(b"".join(map(bytes, ping.image))).hexdigest() for ping in pings}

    def __exit__(self, *_):
        self._client.socket.shutdown(socket.SHUT_RDWR)
        self._thread.join(20)
        self._client.socket.close()


@unittest.skipIf(WHY_NOT, WHY_NOT)
class Foxglove(unittest.TestCase):
    def test_schemas_are_those_of_foxglove(self):
        self.assertGreater(judge("schemas", SCHEMAS)["fields"], 60)

    def test_subprotocols(self):
        with Sonard() as daemon:
            judge("subprotocols", url(daemon))

    def test_channels_decode_and_the_picture_is_what_the_driver_got(self):
        with Sonard(trajectory="orbit") as daemon, Driver(daemon) as driver:
            seen = judge("channels", url(daemon))
            time.sleep(0.5)  # the viewer may receive its last picture before the driver does
        self.assertLessEqual({"/tf", "/scene", "/swath", "/log", "/status", "/faults", "/front/image", "/front/fan", "/front/cloud",
                              "/front/geometry", "/front/ping", "/front/figures"}, set(seen["topics"]))
        taken = driver.sums()
        both = {number: sha for number, sha in seen["images"] if number in taken}
        self.assertGreater(len(both), 10)
        self.assertGreater(len(set(both.values())), 1)
        self.assertEqual(both, {number: taken[number] for number in both})

    def test_parameters(self):
        with Sonard() as daemon:
            judge("parameters", url(daemon))

    def test_services_and_time_after_a_step(self):
        with Sonard(arguments=["--clock", "lockstep"]) as daemon:
            judge("services", url(daemon))

    def test_a_viewer_that_does_not_read_for_a_while(self):
        with Sonard() as daemon, Driver(daemon):
            judge("stalled", url(daemon))

    def test_stepped_time(self):
        with Sonard(trajectory="orbit", arguments=["--clock", "stepped"]) as daemon, Driver(daemon):
            judge("stepped", url(daemon))


if __name__ == "__main__":
    unittest.main()
