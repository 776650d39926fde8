"""Compares the output that the README prints with that of tests/tools/first_minutes.sh, line by line.

Numbers differ from run to run and machine to machine; words must not.
"""
import os
import re
import subprocess
import unittest

from running_sonard import BUILD, ROOT

MACHINE = [(r"cpu, \w+, ", "cpu, SIMD, "), (r"CUDA: .*", "CUDA: x"), (r"\(looked in .*\)", "(looked in PLACES)"),
           (r"^(ok|warn) +rate .*", "rate"), (r"^(ok|warn) +ports .*", "ports"), (r"key=[0-9a-f.]+", "key=KEY"),
           (r"\d+ warnings?", "warnings")]


def words(line):
    for pattern, stand_in in MACHINE:
        line = re.sub(pattern, stand_in, line)
    return re.sub(r"\d+(\.\d+)?", "#", line).strip()


class FirstMinutes(unittest.TestCase):
    def test_the_readme_prints_the_output_of_the_programs(self):
        run = subprocess.run([ROOT / "tests/tools/first_minutes.sh", BUILD.resolve()], stdin=subprocess.DEVNULL,
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=280, check=False,
                             env={**os.environ, "LC_ALL": "C.UTF-8"})
        self.assertEqual(run.returncode, 0, run.stdout)
        came_out = {words(line) for line in run.stdout.splitlines()}
        readme = (ROOT / "README.md").read_text(encoding="utf-8")
        quoted = [line for block in re.findall(r"^```\n(\$ .*?)^```", readme, re.M | re.S) for line in block.splitlines() if line]
        self.assertGreater(len(quoted), 15)
        for line in quoted:
            self.assertIn(words(line), came_out, run.stdout)


if __name__ == "__main__":
    unittest.main()
