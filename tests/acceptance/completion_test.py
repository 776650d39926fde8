"""Tests shell completion: it is up to date with --help, valid, and offers the right words."""
import shutil
import subprocess
import sys
import unittest

from running_sonard import BUILD, ROOT, run

FOLDER = ROOT / "clients/sonarctl/completion"


def complete(program, *words):
    """Returns the words that bash offers for the last word."""
    line = " ".join([program, *words])
    script = f"""
source "{FOLDER / program}"
COMP_WORDS=({' '.join(repr(w) for w in [program, *words])})
COMP_CWORD={len(words)}
_{program}
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
    result = subprocess.run(["bash", "-c", script], capture_output=True, text=True, timeout=30, check=False)
    assert result.returncode == 0 and not result.stderr, (line, result.stderr)
    return result.stdout.split()


class Completion(unittest.TestCase):
    def test_the_files_agree_with_the_help(self):
        result = run(sys.executable, "-B", FOLDER / "make_completion.py", BUILD, "--check")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_commands_options_and_choices_are_offered(self):
        self.assertEqual(complete("sonarctl", "doc"), ["doctor"])
        self.assertEqual(complete("sonarctl", "pose", "ci"), ["circle"])
        self.assertIn("--centre", complete("sonarctl", "pose", "circle", "--"))
        self.assertNotIn("--centre", complete("sonarctl", "view", "--"))
        self.assertEqual(complete("sonarctl", "listen", "--rate", "st"), ["standby"])
        self.assertEqual(complete("sonard", "--clo"), ["--clock"])
        self.assertEqual(complete("sonard", "--clock", "st"), ["stepped"])
        self.assertIn("render", complete("sonard", "re"))

    def test_shells_can_read_the_files(self):
        for program in ("sonarctl", "sonard"):
            self.assertEqual(run("bash", "-n", FOLDER / program).returncode, 0)
            if shutil.which("zsh"):
                self.assertEqual(run("zsh", "-n", FOLDER / f"_{program}").returncode, 0)


if __name__ == "__main__":
    unittest.main()
