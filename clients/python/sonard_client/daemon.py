"""Starts a sonard for as long as a test of yours runs, and stops it."""
from __future__ import annotations

import os
import pathlib
import random
import signal
import subprocess
import tempfile
import time
from typing import Any, List, Optional, Sequence, Union

ADDRESS_TAKEN = 69  # sonard's exit code


class DaemonFailed(RuntimeError):
    """sonard ended, or was not ready in time; the text has its log."""


class Daemon:
    '''with Daemon("my.yaml") as sonard: ...       or the text of a configuration:

    with Daemon("""
    world: {scene: demo.yaml}
    vehicles: [{name: rov}]
    sonars: [{name: front, profile: oculus-m1200d, bind_ip: ADDRESS, status_to: [ADDRESS]}]
    """) as sonard: OculusClient(sonard.address)

    ADDRESS stands for a loopback address of its own, so that several can run at a time: sonard.address.'''

    def __init__(self, config: Union[str, "os.PathLike[str]"], program: str = "sonard", arguments: Sequence[str] = (),
                 patience_s: float = 60.0) -> None:
        is_text = isinstance(config, str) and "\n" in config
        self._text = str(config) if is_text else ""  # of a file it is not needed
        self._path = None if is_text else pathlib.Path(config)
        self._program, self._arguments, self._patience_s = program, [str(a) for a in arguments], patience_s
        self._folder: Optional["tempfile.TemporaryDirectory[str]"] = None
        self._process: Optional["subprocess.Popen[bytes]"] = None
        self.address = ""  # of a configuration with ADDRESS in it

    def __enter__(self) -> Daemon:
        self._folder = tempfile.TemporaryDirectory(prefix="sonard-")
        try:
            for _ in range(5):
                self._start()
                if self._ready():
                    return self
                code = self.process.wait()
                if code != ADDRESS_TAKEN or "ADDRESS" not in self._text:  # else another address may be free
                    raise DaemonFailed(f"sonard ended with code {code}:\n{self.log()}")
            raise DaemonFailed(f"no address was free:\n{self.log()}")
        except BaseException:
            self.__exit__()
            raise

    @property
    def process(self) -> "subprocess.Popen[bytes]":
        if self._process is None:
            raise DaemonFailed("not started: use it as `with Daemon(...) as sonard:`")
        return self._process

    @property
    def _log_path(self) -> pathlib.Path:
        return pathlib.Path(self._folder.name if self._folder else "") / "log"

    def log(self) -> str:
        """What it has printed so far."""
        return self._log_path.read_text(encoding="utf-8", errors="replace")

    def stop(self, patience_s: float = 20.0) -> int:
        """The exit code, after a graceful end."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        return self.process.wait(patience_s)

    def _start(self) -> None:
        path = self._path
        if path is None:
            self.address = f"127.{random.randint(64, 126)}.{random.randint(0, 255)}.{random.randint(1, 254)}"
            path = self._log_path.with_name("sonard.yaml")
            path.write_text(self._text.replace("ADDRESS", self.address), encoding="utf-8")
        command: List[str] = [self._program, "run", str(path), *self._arguments]
        with open(self._log_path, "wb") as log:
            self._process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT)

    def _ready(self) -> bool:
        deadline = time.monotonic() + self._patience_s
        while time.monotonic() < deadline:
            if "\nready in " in self.log():
                return True
            if self.process.poll() is not None:
                return False
            time.sleep(0.02)
        raise DaemonFailed(f"sonard was not ready within {self._patience_s:g} s:\n{self.log()}")

    def __exit__(self, *_: Any) -> None:
        if self._process is not None and self._process.poll() is None:
            try:
                self.stop()
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        if self._folder is not None:
            self._folder.cleanup()
