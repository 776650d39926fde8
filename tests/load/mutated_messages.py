"""Measures the memory of a daemon with a sonar of every make while clients send mutated messages to one port of each.
Run by hand:
build/release/tests/own_network/in_own_network python3 tests/load/mutated_messages.py [SECONDS]

Many of the messages are valid and change settings, so that the tables for settings and the cells of the scene fill up to their
bounds (tests/reliability/README.md, "Memory").
"""
import contextlib
import pathlib
import random
import socket
import struct
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/acceptance")]
from makes_test import MAKES  # noqa: E402
from running_sonard import SONARD, Daemon  # noqa: E402

SECONDS = float(sys.argv[1]) if len(sys.argv) > 1 else 200
EACH_S = min(60, SECONDS / 10)
CORPUS = ROOT / "tests/fuzz/corpus"
DATAGRAMS = {"ping360", "ping1d", "surveyor-240", "omniscan-450", "s500"}
SEEDS = {"oculus-m1200d": "oculus", "blueview-p900-90": "blueview", "aris-3000": "aris", "ping360": "ping360", "surveyor-240": "surveyor",
         "omniscan-450": "omniscan450", "ping1d": "ping1d", "s500": "s500", "dvl-a50": "dvl", "micron": "micron", "norbit-wbms": "norbit"}
HTTP = [("/udp", b'{"mode":"multicast"}'), ("/acoustics", b'{"acoustics_enabled":true}'), ("/range", b'{"min":1,"max":10}')]


def seeds_of(profile):
    if profile in SEEDS:
        return [(CORPUS / "devices" / f"{SEEDS[profile]}.bin").read_bytes()]
    return [b"POST /api/v1/integration%s HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: %d\r\n\r\n%s"
            % (path.encode(), len(body), body) for path, body in HTTP] if profile == "waterlinked-3d15" else [b"junk"]


def resealed(message):
    """Returns the message; frames of the Ping protocol at its start get correct checksums."""
    out, at = bytearray(message), 0
    while at + 10 <= len(out) and out[at:at + 2] == b"BR":
        end = at + 8 + struct.unpack_from("<H", out, at + 2)[0]
        if end + 2 > len(out):
            break
        struct.pack_into("<H", out, end, sum(out[at:end]) & 0xFFFF)
        at = end + 2
    return bytes(out)


def mutated(message, chance):
    out = bytearray(message)
    for _ in range(chance.choice((0, 1, 1, 2, 4))):
        at = chance.randrange(len(out))
        kind = chance.randrange(4)
        if kind == 0:
            out[at] ^= 1 << chance.randrange(8)
        elif kind == 1:
            out[at] = chance.randrange(256)
        elif kind == 2 and chance.random() < 0.3:
            del out[at:at + chance.randrange(1, 9)]
        elif chance.random() < 0.3:
            out[at:at] = out[:chance.randrange(1, 64)]
        if not out:
            return bytes(message)
    return resealed(out) if chance.random() < 0.8 else bytes(out)


class Stranger:
    """Makes connections to one port, one after another."""

    def __init__(self, profile, address, port, kind):
        self.place, self.kind, self.seeds = (address, port), kind, seeds_of(profile)
        self.chance, self.socket, self.left = random.Random(f"{profile} {kind}"), None, 0
        self.sent = 0

    def turn(self):
        try:
            if self.left == 0:
                if self.socket is not None:
                    self.socket.close()
                self.socket = socket.socket(socket.AF_INET, self.kind)
                self.socket.settimeout(0.05)
                self.socket.connect(self.place)
                self.left = self.chance.choice((1, 5, 20, 200))
            self.left -= 1
            self.socket.send(mutated(self.chance.choice(self.seeds), self.chance))
            self.sent += 1
            self.socket.setblocking(False)
            for _ in range(8):
                if not self.socket.recv(1 << 18):
                    self.left = 0
                    break
        except BlockingIOError:
            pass
        except OSError:
            self.left = 0


def memory_of(process):
    """Returns {"VmRSS": kB, "RssAnon": kB}."""
    lines = pathlib.Path(f"/proc/{process.pid}/status").read_text(encoding="ascii").splitlines()
    return {name: int(value.split()[0]) for name, value in (line.split(":", 1) for line in lines) if name in ("VmRSS", "RssAnon")}


def main():
    sonars, places = "", []
    for k, (profile, (port, *_)) in enumerate(MAKES.items()):
        ip = f"127.0.0.{k + 10}"
        down = ", rpy_deg: [0, 90, 0]" if profile in ("surveyor-240", "ping1d", "s500", "dvl-a50", "norbit-wbms") else ""
        sonars += f"  - {{name: s{k}, profile: {profile}, bind_ip: {ip}, mount: {{frame: FLU{down}}}}}\n"
        kinds = [socket.SOCK_DGRAM] if profile in ("ping360", "ping1d", "s500") else [socket.SOCK_STREAM]
        kinds += [socket.SOCK_DGRAM] if profile in ("surveyor-240", "omniscan-450") else []
        places += [(profile, ip, port, kind) for kind in kinds]
    config = (f"world: {{scene: {ROOT / 'scenes/demo.yaml'}}}\nvehicles: [{{name: rov, trajectory: orbit}}]\nsonars:\n{sonars}"
              "limits: {spare_descriptors: 8}\n")
    strangers = [Stranger(*place) for place in places]
    with Daemon(config, str(SONARD)) as daemon:
        begin = looked = time.monotonic()
        print(f"pid {daemon.process.pid}\n{'s':>6} {'VmRSS MB':>9} {'RssAnon':>8} {'messages':>9}", flush=True)
        while (now := time.monotonic()) < begin + SECONDS:
            for stranger in strangers:
                stranger.turn()
            time.sleep(0.002)
            if now >= looked + EACH_S:
                looked = now
                memory = memory_of(daemon.process)
                print(f"{now - begin:6.0f} {memory['VmRSS'] / 1024:9.1f} {memory['RssAnon'] / 1024:8.1f} "
                      f"{sum(s.sent for s in strangers):9}", flush=True)
        daemon.stop()
        with contextlib.suppress(OSError):
            print("\n".join(daemon.log().splitlines()[-40:]))


if __name__ == "__main__":
    main()
