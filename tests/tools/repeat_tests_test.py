"""Tests that repeat_tests.sh names a test that fails in 2 of 100 runs."""
import os
import pathlib
import subprocess
import tempfile
import unittest

TOOL = pathlib.Path(__file__).with_name("repeat_tests.sh")


class Repeated(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def lines(self, runs, script, expected, busy_loops=0):
        """Returns the tool's output for a good test and a test that runs a shell script with the number of the run in $n."""
        (self.folder / "test.sh").write_text(f"n=$(($(cat n 2>/dev/null || echo 0) + 1)); echo $n >n\n{script}\n", encoding="utf-8")
        (self.folder / "CTestTestfile.cmake").write_text(
            'add_test(good "true")\nadd_test([=[now and then]=] "sh" "test.sh")\n'
            f'set_tests_properties([=[now and then]=] PROPERTIES WORKING_DIRECTORY "{self.folder}")\n', encoding="utf-8")
        done = subprocess.run([TOOL, str(runs)], env={**os.environ, "SONARD_BUILD": str(self.folder), "SONARD_BUSY_LOOPS": str(busy_loops)},
                              stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=800, check=False)
        self.assertEqual(done.returncode, expected, done.stdout + done.stderr)
        self.assertEqual((self.folder / "n").read_text(), f"{runs}\n")
        return done.stdout.splitlines()

    def test_two_failures_in_a_hundred_runs_are_named_at_the_end(self):
        said = self.lines(100, "[ $n != 37 ] && [ $n != 71 ]", 1)
        self.assertEqual(said[100:], [f"FAILED in 2 of 100 runs: now and then ({self.folder}/repeat/run-37.log)"])

    def test_a_run_without_failures_says_so(self):
        self.assertEqual(self.lines(2, "true", 0, busy_loops=1)[2:], ["no test failed in 2 runs"])


if __name__ == "__main__":
    unittest.main()
