"""A vehicle that dives through the tank on a trajectory, in stepped time, for the tests of reproducibility and of whole
missions. The trajectory is a file in the run's folder; all bytes that a client received are kept."""
import hashlib
import math
import pathlib
import re
import threading

from oculus_reader import Client, Ping, fire_message
from running_sonard import SONARCTL, Sonard, run

RATE_HZ = 2
TWO_CLIENTS = "{frame: FLU, xyz_m: [0, 0, 0]}\n    clients: {max: 2}"  # inserted after `mount:`, so it also adds a key of the sonar


def way(seconds):
    """Returns a slow curve in front of the rod, which turns: CSV lines of two bodies, every 0.2 s."""
    lines = ["# frame: ENU_FLU", "body,t_s,x_m,y_m,z_m,yaw_deg"]
    for step in range(5 * seconds + 1):
        t = step / 5
        lines.append(f"rov,{t:.1f},{-0.5 + 0.1 * math.cos(t / 7):.6f},{0.2 * math.sin(t / 5):.6f},-0.61,{10 * math.sin(t / 3):.4f}")
        lines.append(f"rod,{t:.1f},0.1508,0,-0.61,{(3 * t) % 360:.4f}")
    return "\n".join(lines) + "\n"


class Mission:
    """with Mission(seconds) as m: m.fly() ... m.stream, m.digests; the daemon runs before fly(), and has ended after it."""

    def __init__(self, seconds, pings, *arguments, start_s=0, record=()):
        self.pings, self.record = pings, record
        self.daemon = Sonard(
            scene="tank-rod.yaml", mount=TWO_CLIENTS, trajectory=f"{{file: way.csv, start_s: {start_s}}}",
            more=f"objects: [{{name: rod, trajectory: {{file: way.csv, start_s: {start_s}}}}}]\nrecording: {{folder: recordings}}\n",
            arguments=["--clock", "stepped", "--digest", "--exit-after-pings", pings, *arguments])
        self.folder = pathlib.Path(self.daemon.folder.name)
        (self.folder / "way.csv").write_text(way(seconds), encoding="utf-8")
        (self.folder / "recordings").mkdir()
        self.stream, self.digests = b"", {}

    def __enter__(self):
        self.daemon.__enter__()
        self.control = f"{self.daemon.address}:14770"
        try:
            for name in self.record:
                self.steer("recording", "start", name)
        except BaseException:
            self.daemon.__exit__()
            raise
        return self

    def __exit__(self, *what):
        self.daemon.__exit__(*what)

    def steer(self, *words):
        done = run(SONARCTL, *words, "--control", self.control)
        assert done.returncode == 0, done.stderr
        return done.stdout

    def recorded(self, name):
        return self.folder / "recordings" / name

    def fly(self, keep=True, after=None):
        """Reads to the end. `after`: a number of pings, and a function to call after them. Without `keep`, only a hash is kept."""
        taken, said = 0, hashlib.sha256()
        with Client(self.daemon.address, patience_s=120) as client:
            client.send(fire_message(version=2, rate_hz=RATE_HZ, range_=1, flags=0x09))
            try:
                while True:
                    kind, message = client.message()
                    said.update(message)
                    if keep:
                        self.stream += message
                    taken += kind == 0x23
                    if after is not None and kind == 0x23 and taken == after[0]:
                        after[1]()
            except (EOFError, ConnectionResetError):
                pass
        self.taken, self.sha256 = taken, said.hexdigest()
        self.code = self.daemon.wait()
        self.digests = {int(number): digest for digest, number in
                        re.findall(r"sha256 ([0-9a-f]{64})  front client (\d+) ", self.daemon.log())}
        return self

    def pictures(self):
        """Returns the pings of the stream."""
        found, rest = [], self.stream
        while rest:
            size = 16 + int.from_bytes(rest[10:14], "little")
            if rest[6] == 0x23:
                found.append(Ping(rest[:size]))
            rest = rest[size:]
        return found


class Onlooker:
    """A second client that requests nothing and reads everything."""

    def __init__(self, address):
        self.pings = 0
        self.client = Client(address, patience_s=120)
        self.thread = threading.Thread(target=self.read)
        self.thread.start()

    def read(self):
        try:
            while True:
                self.pings += self.client.message()[0] == 0x23
        except (EOFError, OSError):
            pass

    def end(self):
        self.thread.join(120)
        self.client.socket.close()
