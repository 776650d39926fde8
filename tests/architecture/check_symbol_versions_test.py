#!/usr/bin/env python3
"""Tests check_symbol_versions.py on samples of the output of objdump."""
import unittest

from check_symbol_versions import newer

SAMPLE = """
a.so:     file format elf64-x86-64

Dynamic Section:
  NEEDED               libc.so.6

Version definitions:
1 0x01 0x0d2a5a05 a.so.1
2 0x00 0x0b792650 GLIBC_2.99

Version References:
  required from libc.so.6:
    0x069691b5 0x00 05 GLIBC_2.35
    0x069691b6 0x00 03 GLIBC_2.36
    0x0d696914 0x00 02 GLIBC_2.4
  required from libstdc++.so.6:
    0x0297f860 0x00 04 GLIBCXX_3.4.30

DYNAMIC SYMBOL TABLE:
0000000000000000      DF *UND*\t0000000000000000 (GLIBC_2.4)  strtoul
0000000000000000      DF *UND*\t0000000000000000 (GLIBC_2.36) arc4random
0000000000000000  w   D  *UND*\t0000000000000000  Base        __gmon_start__
0000000000000000      DF *UND*\t0000000000000000 (GLIBCXX_3.4.30) _ZSt1a
0000000000001000 g    DF .text\t0000000000000010  GLIBC_2.99  defined_here
"""


class Newer(unittest.TestCase):
    def test_the_symbol_of_a_newer_version_is_named(self):
        self.assertEqual(newer(SAMPLE, {"GLIBC": "2.35"}), ["GLIBC_2.36 (arc4random)"])

    def test_numbers_are_compared_as_numbers(self):
        self.assertEqual(newer(SAMPLE, {"GLIBC": "2.36"}), [], "2.4 is older than 2.36")
        self.assertEqual(len(newer(SAMPLE, {"GLIBC": "2.3"})), 3)

    def test_each_family_has_its_limit(self):
        self.assertEqual(newer(SAMPLE, {"GLIBCXX": "3.4.29"}), ["GLIBCXX_3.4.30 (_ZSt1a)"])
        self.assertEqual(newer(SAMPLE, {"GLIBCXX": "3.4.30", "CXXABI": "1.3.13"}), [])

    def test_a_reference_counts_without_a_symbol(self):
        references = "  required from libc.so.6:\n    0x069691b6 0x00 03 GLIBC_2.36\n    0x0fd0e42f 0x00 09 GLIBC_ABI_DT_RELR\n"
        self.assertEqual(newer(references, {"GLIBC": "2.35"}), ["GLIBC_2.36 (no symbol)", "GLIBC_ABI_DT_RELR (no symbol)"])


if __name__ == "__main__":
    unittest.main()
