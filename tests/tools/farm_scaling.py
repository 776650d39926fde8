#!/usr/bin/env python3
"""Simulates the farm of docs/datasets.md with 1 to 10,000 workers at one queue.

usage: farm_scaling.py [--svg FILE]     prints the table of efficiencies; --svg also draws it
       farm_scaling.py --measure        measures the costs of a nats-server on loopback (COSTS below)

Efficiency: the sum of the workers' computing times, divided by the number of workers times the time until the last
shard is acknowledged. The server does one thing at a time, in order of arrival; a worker waits for its answers. Each worker has
50 shards on average. The time of the file system is ignored.
"""
import argparse
import heapq
import json
import os
import pathlib
import random
import socket
import subprocess
import tempfile
import time

# Processor time of nats-server 2.9.10 on an AMD EPYC [s], measured by --measure.
COSTS = {"take": 125e-6, "look": 125e-6, "beat": 80e-6, "acknowledge": 90e-6}
NETWORK_S = 0.0005  # there and back, without the server's time
SPREAD = 0.3          # standard deviation of a shard's time over its mean: mines.yaml on a busy machine
BETWEEN_BEATS_S = 5.0
SHARDS_EACH = 50


def efficiency(workers, shard_s, rng):
    shards, server_free, computed, end = workers * SHARDS_EACH, 0.0, 0.0, 0.0
    # Events are the requests of workers, in order of time. Each shard has those of COSTS in that order.
    events = [(rng.random() * 0.01, worker, "take", 0.0) for worker in range(workers)]
    heapq.heapify(events)
    following = {"take": "look", "look": "compute", "acknowledge": "take"}
    while events:
        at, worker, what, left_s = heapq.heappop(events)
        if what == "take":
            if shards == 0:
                continue
            shards -= 1
        begin = max(at, server_free)
        server_free = begin + COSTS[what]
        answered = server_free + NETWORK_S
        if what == "acknowledge":
            end = max(end, answered)
        if what == "beat":  # computing continues meanwhile
            answered = at
        step = following.get(what, "compute")
        if step == "compute":
            if what == "look":
                left_s = max(shard_s * (1 + SPREAD * rng.gauss(0, 1)), 0.2 * shard_s)
                computed += left_s
                heapq.heappush(events, (answered, -1 - worker, "beat", 0.0))
            elif worker < 0:
                continue
            part = min(left_s, BETWEEN_BEATS_S)
            step = "beat" if left_s > part else "acknowledge"
            heapq.heappush(events, (answered + part, worker, step, left_s - part))
        else:
            heapq.heappush(events, (answered, worker, step, 0.0))
    return computed / (workers * end)


class Client:
    """The part of the NATS protocol that a worker needs."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.file = self.socket.makefile("rb")
        self.file.readline()
        self.socket.sendall(b'CONNECT {"verbose":false,"headers":true}\r\nSUB answer 1\r\n')

    def ask(self, subject, body=b""):
        self.socket.sendall(f"PUB {subject} answer {len(body)}\r\n".encode() + body + b"\r\n")
        return self.message()

    def message(self):
        while True:
            words = self.file.readline().split()
            if words[0] == b"PING":
                self.socket.sendall(b"PONG\r\n")
            elif words[0] in (b"MSG", b"HMSG"):
                reply = words[3].decode() if len(words) > (4 if words[0] == b"MSG" else 5) else ""
                return reply, self.file.read(int(words[-1]) + 2)


def measure(shards=3000):
    with tempfile.TemporaryDirectory() as folder, socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        port = s.getsockname()[1]
        s.close()
        with subprocess.Popen(["nats-server", "-js", "-sd", folder, "-a", "127.0.0.1", "-p", str(port)], stderr=subprocess.DEVNULL) as server:
            time.sleep(1)
            client = Client(port)

            def make(subject, words):
                assert b'"error"' not in (answer := client.ask(subject, json.dumps(words).encode())[1]), answer
            make("$JS.API.STREAM.CREATE.FARM", {"name": "FARM", "subjects": ["farm.work.>"], "retention": "workqueue", "storage": "file"})
            make("$JS.API.STREAM.CREATE.KV_T", {"name": "KV_T", "subjects": ["$KV.T.>"], "max_msgs_per_subject": 1, "storage": "file", "allow_direct": True})
            make("$JS.API.CONSUMER.DURABLE.CREATE.FARM.j", {"stream_name": "FARM", "config": {
                "durable_name": "j", "ack_policy": "explicit", "ack_wait": 60_000_000_000, "max_ack_pending": 100_000, "filter_subject": "farm.work.j.*"}})
            for shard in range(shards):
                client.ask(f"farm.work.j.{shard}")
            tasks = []

            def take():
                tasks.append(client.ask("$JS.API.CONSUMER.MSG.NEXT.FARM.j", b'{"batch":1}')[0])
            acts = {"take": take, "look": lambda: client.ask("$JS.API.STREAM.MSG.GET.KV_T", b'{"last_by_subj":"$KV.T.no"}'),
                    "beat": lambda: client.ask("$KV.T.host", b"x" * 150), "acknowledge": lambda: client.ask(tasks.pop(), b"+ACK")}
            for name, act in acts.items():
                cpu, begin = cpu_s(server.pid), time.monotonic()
                for _ in range(shards):
                    act()
                wall = (time.monotonic() - begin) / shards
                print(f"{name}: {1e6 * (cpu_s(server.pid) - cpu) / shards:.0f} us of the server, {1e6 * wall:.0f} us until the answer")
            server.terminate()


def cpu_s(pid):
    words = pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def draw(table, file):
    import matplotlib  # pylint: disable=import-outside-toplevel
    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "sonard"
    import matplotlib.pyplot as plt  # pylint: disable=import-outside-toplevel
    figure, axes = plt.subplots(figsize=(6, 3.2))
    for shard_s, points in table.items():
        axes.semilogx([n for n, _ in points], [100 * e for _, e in points], marker="o", label=f"shards of {shard_s:g} s")
    axes.set(xlabel="workers (simulated)", ylabel="efficiency, %", ylim=(0, 102))
    axes.grid(alpha=0.3)
    axes.legend()
    figure.tight_layout()
    figure.savefig(file, metadata={"Date": None})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--svg")
    parser.add_argument("--measure", action="store_true")
    arguments = parser.parse_args()
    if arguments.measure:
        return measure()
    table = {}
    for shard_s in (1.0, 5.0, 60.0):
        for workers in (1, 10, 100, 1000, 3000, 10000):
            table.setdefault(shard_s, []).append((workers, efficiency(workers, shard_s, random.Random(1))))
        print(f"shards of {shard_s:g} s: " + ", ".join(f"{n} workers {100 * e:.1f} %" for n, e in table[shard_s]))
    if arguments.svg:
        draw(table, arguments.svg)
    return None


if __name__ == "__main__":
    main()
