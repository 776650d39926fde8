#!/usr/bin/env python3
"""Tests that tests/tools/release.sh refuses a tree that differs from its commit."""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Refusals(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.tree = pathlib.Path(folder.name)
        (self.tree / "tests/tools").mkdir(parents=True)
        for script in ("release.sh", "bare_root.sh", "setup.sh"):
            shutil.copy(ROOT / "tests/tools" / script, self.tree / "tests/tools")
        (self.tree / "CMakeLists.txt").write_text("project(sonard VERSION 1.2.3 LANGUAGES CXX)\n", encoding="utf-8")
        (self.tree / ".gitignore").write_text("/out/\n", encoding="utf-8")
        self.git("init", "-q")
        self.git("add", ".")
        self.git("commit", "-q", "-m", "all")

    def git(self, *arguments):
        subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@b", *arguments], cwd=self.tree, check=True, capture_output=True)

    def release(self, *steps):
        """Returns exit code and messages. It has its own home folder, so that it changes no system of a real release."""
        done = subprocess.run([self.tree / "tests/tools/release.sh", *steps], env=os.environ | {"HOME": str(self.tree / "out"),
                              "XDG_CACHE_HOME": str(self.tree / "out")}, capture_output=True, text=True, check=False, timeout=60)
        return done.returncode, done.stdout + done.stderr

    def test_a_changed_file_and_a_new_one_are_named(self):
        (self.tree / "new.cpp").touch()
        (self.tree / "CMakeLists.txt").write_text("project(sonard VERSION 1.2.4 LANGUAGES CXX)\n", encoding="utf-8")
        code, said = self.release("sums")
        self.assertEqual(code, 65)
        self.assertIn("?? new.cpp", said)
        self.assertIn("M CMakeLists.txt", said)
        self.assertFalse((self.tree / "out").exists())

    def test_a_tag_of_another_version_is_refused(self):
        self.git("tag", "v1.2.4")
        code, said = self.release("sums")
        self.assertEqual((code, "tag v1.2.4" in said, "1.2.3" in said), (65, True, True))

    def test_an_unknown_step_is_refused_before_the_build(self):
        code, said = self.release("sums", "debain12")
        self.assertEqual((code, "usage:" in said), (64, True))
        self.assertFalse((self.tree / "out").exists())

    def test_a_clean_tree_with_the_right_tag_is_accepted(self):
        self.git("tag", "v1.2.3")
        (self.tree / "out/release").mkdir(parents=True)
        (self.tree / "out/release/a.tar.gz").write_bytes(b"a")
        code, said = self.release("sums")
        self.assertEqual(code, 0, said)
        self.assertIn("ca978112ca1bbdcafac231b39a23dc4da786eff8147c4e72b9807785afee48bb  a.tar.gz", said)


if __name__ == "__main__":
    unittest.main()
