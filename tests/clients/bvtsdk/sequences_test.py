"""Runs the call-sequence programs of programs/, one after the other, against a live daemon with the L targets in front of it."""
import pathlib
import tempfile
import unittest

from prefixes import PROGRAMS, l_targets, prefix, run


class Sequences(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = l_targets().__enter__()
        cls.folder = tempfile.TemporaryDirectory()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.__exit__()
        cls.folder.cleanup()

    def program(self, name, *arguments):
        done = run(PROGRAMS / name, *arguments)
        print(f"{name}:\n{done.stdout}", end="", flush=True)
        self.assertEqual(done.returncode, 0, done.stderr)

    def file(self, name):
        return pathlib.Path(self.folder.name) / name

    def test_cpp4_settings_xy_profile(self):
        self.program("cpp4_settings_xy_profile", self.daemon.address, prefix(4) / "colormaps")

    def test_cpp4_record_colours_playback(self):
        self.program("cpp4_record_colours_playback", self.daemon.address, prefix(4) / "colormaps", self.file("recorded.son"))

    def test_c4_rtheta_with_retries(self):
        self.program("c4_rtheta_with_retries", self.daemon.address, "127.0.0.9")

    def test_c4_logger_thread(self):
        self.program("c4_logger_thread", self.daemon.address, self.file("log.son"))

    def test_c4_shared_between_threads(self):
        self.program("c4_shared_between_threads", self.daemon.address)

    def test_c4_open_close_cycles(self):
        self.program("c4_open_close_cycles", self.daemon.address, 1000)

    def test_c3_discovery_then_file(self):
        self.program("c3_discovery_then_file", self.daemon.address, prefix(3) / "colormaps", self.file("found.son"))
        self.assertEqual(self.file("found.son.ppm").read_bytes()[:3], b"P6\n")

    def test_c3_retry_settings_receive_only(self):
        self.program("c3_retry_settings_receive_only", self.daemon.address, "127.0.0.9")


if __name__ == "__main__":
    unittest.main()
