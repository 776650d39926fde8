"""Runs a sonard for the duration of a test."""
from __future__ import annotations

import os
import pathlib
import random
import signal
import subprocess
import tempfile
import time
from typing import Any, List, Optional, Sequence, Union

ADDRESS_IN_USE = 69  # sonard's exit code


def free_address() -> str:
    """Returns a random loopback address, which other programs are unlikely to use."""
    return f"127.{random.randint(64, 126)}.{random.randint(0, 255)}.{random.randint(1, 254)}"


class DaemonFailed(RuntimeError):
    """sonard exited or was not ready in time; the text contains its log. `code`: its exit code, None while it runs."""

    def __init__(self, text: str, code: Optional[int] = None):
        super().__init__(text)
        self.code = code


class Daemon:
    '''with Daemon("my.yaml") as sonard: ...       or the text of a configuration:

    with Daemon("""
    world: {scene: demo.yaml}
    vehicles: [{name: rov}]
    sonars: [{name: front, profile: PRODUCT, bind_ip: ADDRESS, status_to: [ADDRESS]}]
    """) as sonard: drive(sonard.address)

    ADDRESS is replaced by a random loopback address (sonard.address), so several daemons can run at once. None runs the demo.'''

    def __init__(self, config: Union[str, "os.PathLike[str]", None], program: str = "sonard", arguments: Sequence[str] = (),
                 timeout_s: float = 60.0) -> None:
        is_text = isinstance(config, str) and "\n" in config
        self._text = str(config) if is_text else ""
        self._path = None if is_text or config is None else pathlib.Path(config)
        self._program, self._arguments, self._timeout_s = program, [str(a) for a in arguments], timeout_s
        self._folder: Optional["tempfile.TemporaryDirectory[str]"] = None
        self._process: Optional["subprocess.Popen[bytes]"] = None
        self.address = ""  # replaces ADDRESS in the configuration

    def __enter__(self) -> Daemon:
        self._folder = self._folder or tempfile.TemporaryDirectory(prefix="sonard-")
        try:
            for _ in range(5):
                self._start()
                if self._ready():
                    return self
                code = self.process.wait()
                if code != ADDRESS_IN_USE or "ADDRESS" not in self._text:  # otherwise try another address
                    raise DaemonFailed(f"sonard exited with code {code}:\n{self.log()}", code)
            raise DaemonFailed(f"no free address found:\n{self.log()}")
        except BaseException:
            self.__exit__()
            raise

    @property
    def process(self) -> "subprocess.Popen[bytes]":
        if self._process is None:
            raise DaemonFailed("not started: use `with Daemon(...) as sonard:`")
        return self._process

    @property
    def _log_path(self) -> pathlib.Path:
        return pathlib.Path(self._folder.name if self._folder else "") / "log"

    def log(self) -> str:
        """Returns the output of sonard so far."""
        return self._log_path.read_text(encoding="utf-8", errors="replace")

    def ended(self) -> str:
        """Returns how sonard ended: "killed by SIGSEGV", "with exit code 70"; empty while it runs."""
        code = self.process.poll()
        if code is None:
            return ""
        return f"killed by {signal.Signals(-code).name}" if code < 0 else f"with exit code {code}"

    def stop(self, timeout_s: float = 20.0) -> int:
        """Stops sonard with SIGTERM and returns its exit code."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        return self.process.wait(timeout_s)

    def _start(self) -> None:
        if self._text:
            self.address = free_address()
        config = str(self.write_config()) if self._text or self._path else "--demo"
        self._launch([self._program, "run", config, *self._arguments])

    def write_config(self) -> pathlib.Path:
        """Writes the configuration for `address`, if it was given as text, and returns its path."""
        if self._path is not None:
            return self._path
        path = self._log_path.with_name("sonard.yaml")
        path.write_text(self._text.replace("ADDRESS", self.address), encoding="utf-8")
        return path

    def _launch(self, command: List[str]) -> None:
        with open(self._log_path, "wb") as log:
            self._process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT)

    def _ready(self) -> bool:
        deadline = time.monotonic() + self._timeout_s
        while time.monotonic() < deadline:
            if "ready in " in self.log():
                return True
            if self.process.poll() is not None:
                return False
            time.sleep(0.02)
        raise DaemonFailed(f"sonard was not ready within {self._timeout_s:g} s:\n{self.log()}")

    def __exit__(self, *_: Any) -> None:
        if self._process is not None and self._process.poll() is None:
            try:
                self.stop()
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        if self._folder is not None:
            self._folder.cleanup()
