#!/usr/bin/env python3
"""Tests check_hardening on programs made without each guard: it must report each, and nothing in a program with all guards."""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from check_hardening import missing

SOURCE = """
#include <cstdio>
#include <cstring>
int main(int count, char** values) {
  char text[8];
  std::strncpy(text, values[0], static_cast<std::size_t>(count));
  return std::puts(text) < 0;
}
"""
GUARDS = ["-O2", "-U_FORTIFY_SOURCE", "-D_FORTIFY_SOURCE=2", "-fstack-protector-strong", "-fPIE", "-pie", "-Wl,-z,relro,-z,now"]
WITHOUT = {
    "-pie": ["-fno-pie", "-no-pie"],
    "-z relro": ["-Wl,-z,norelro"],
    "-z now": ["-Wl,-z,lazy"],
    "-fstack-protector-strong": ["-fno-stack-protector"],
    "_FORTIFY_SOURCE": ["-U_FORTIFY_SOURCE"],
}


class Hardening(unittest.TestCase):
    def check(self, flags: list[str]) -> list[str]:
        with tempfile.TemporaryDirectory() as folder:
            program = Path(folder) / "program"
            subprocess.run(["c++", "-w", "-x", "c++", "-", "-o", program, *flags], input=SOURCE, text=True, check=True)
            return missing(str(program))

    def test_a_program_with_all_guards_passes(self):
        self.assertEqual(self.check(GUARDS), [])

    def test_each_missing_guard_is_found(self):
        for name, flags in WITHOUT.items():
            with self.subTest(name):
                lines = self.check(GUARDS + flags)
                self.assertEqual(len(lines), 1, lines)
                self.assertIn(name, lines[0])


if __name__ == "__main__":
    sys.exit(unittest.main())
