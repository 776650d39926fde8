"""Tests what .ci/run and arm64.sh omit, which compiler setup.sh chooses, and how run_programs.py and test_times.py name
failures."""
import os
import pathlib
import re
import select
import subprocess
import sys
import tempfile
import unittest

TOOLS = pathlib.Path(__file__).resolve().parent
ROOT = TOOLS.parents[1]
HEAVY = {"package", "page", "cuda", "bench", "levels", "sanitizers"}
# A stand-in for a GoogleTest program, with the functions that run_programs.py uses.
PROGRAM = """#!/bin/sh
echo "$0 part $GTEST_SHARD_INDEX of $GTEST_TOTAL_SHARDS" >>"$RAN"
echo "[ RUN      ] Suite.Ended"
{ending}
"""


class LeftOut(unittest.TestCase):
    def left_out(self, *files):
        done = subprocess.run([ROOT / ".ci/run", "--left-out", *files], capture_output=True, text=True, check=True)
        return set(done.stdout.split())

    def test_checks_that_the_changed_files_cannot_affect_are_omitted(self):
        self.assertEqual(self.left_out("docs/faults.md"), HEAVY)
        self.assertEqual(self.left_out("clients/sonarctl/listen.cpp", "docs/faults.md"), HEAVY)
        self.assertEqual(self.left_out("core/pipeline/cpu/simulate.cpp"), {"package", "page"})
        self.assertEqual(self.left_out("clients/web/main.js"), HEAVY - {"page"})
        for file in ("daemon/debian/postrm", "daemon/systemd/sonard.service", "tests/judge/right_driver.py", "core/requirements.cmake"):
            with self.subTest(file=file):
                self.assertNotIn("package", self.left_out(file))
        self.assertEqual(self.left_out("daemon/CMakeLists.txt"), HEAVY - {"package", "sanitizers"})
        for file in ("tests/protocol/hosts_test.cpp", "tests/is_sanitized.hpp", "clients/bvtsdk/core/link.cpp", "tests/fuzz/corpus/hosts/a.bin"):
            with self.subTest(file=file):
                self.assertNotIn("sanitizers", self.left_out(file))

    def test_no_check_is_omitted_when_the_build_or_the_checks_change(self):
        for file in ("CMakeLists.txt", "CMakePresets.json", ".ci/run", "test.sh", "tests/tools/setup.sh", "tests/CMakeLists.txt", ""):
            with self.subTest(file=file):
                self.assertEqual(self.left_out("docs/faults.md", file) if file else self.left_out(), set())


class Configure(unittest.TestCase):
    """setup.sh in a folder of its own, with stubs for the programs that it calls."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def stub(self, name, script):
        path = self.folder / name
        path.write_text(f"#!/bin/sh\n{script}\n")
        path.chmod(0o755)

    def setup(self, command):
        environment = dict(os.environ) | {"PATH": f"{self.folder}:{os.environ['PATH']}", "SONAR_WERROR": "ON"}
        return subprocess.run(["bash", "-c", f'. "{TOOLS}/setup.sh"; need_packages() {{ echo "needs $*"; }}; {command}'], cwd=self.folder,
                              capture_output=True, text=True, env=environment, check=False)

    def configured(self, clang):
        self.stub("clang++", clang)
        return self.setup('configure() { echo "$*"; }; configure_sanitized asan')

    def test_sanitized_programs_use_clang_with_warnings_as_errors(self):
        done = self.configured("exit 0")
        self.assertEqual((done.stdout, done.stderr), ("needs clang libclang-rt-dev lld\nasan -DSONAR_WERROR=ON\n", ""))

    def test_sanitized_programs_use_the_default_compiler_if_clang_cannot_link(self):
        done = self.configured("exit 1")
        self.assertIn("\nasan -DCMAKE_C_COMPILER=cc -DCMAKE_CXX_COMPILER=c++ -DCMAKE_EXE_LINKER_FLAGS= -DSONAR_WERROR=OFF\n", done.stdout)
        self.assertIn("no clang that links sanitized programs", done.stderr)

    def test_a_changed_compiler_causes_a_new_configuration(self):
        self.stub("cmake", 'echo run >>ran; [ ! -f build/asan/CMakeCache.txt ] || '
                           'echo "You have changed variables that require your cache to be deleted."')
        cache = self.folder / "build/asan/CMakeCache.txt"
        cache.parent.mkdir(parents=True)
        cache.write_text("")
        for runs in (2, 3):  # the second time nothing changed
            self.assertEqual(self.setup("configure asan").returncode, 0)
            self.assertFalse(cache.exists())
            self.assertEqual(len((self.folder / "ran").read_text().split()), runs)

    def test_a_failed_configuration_prints_the_reason(self):
        self.stub("cmake", "echo no compiler; exit 1")
        done = self.setup("configure asan")
        self.assertEqual((done.returncode, done.stderr), (1, "no compiler\nconfiguring preset asan failed: see above\n"))


    def test_background_work_yields_and_reports_its_end(self):
        os.mkfifo(self.folder / "nice")
        done = self.setup('begin_aside log sh -c "nice >nice; echo ended; exit 3"; cat nice; end_aside')
        self.assertEqual((done.returncode, done.stdout, (self.folder / "log").read_text()), (3, "19\n", "ended\n"))

    def test_background_work_ends_with_the_shell(self):
        held = self.folder / "held"
        os.mkfifo(held)
        reader = os.open(held, os.O_RDONLY | os.O_NONBLOCK)
        self.addCleanup(os.close, reader)
        done = self.setup('begin_aside log sh -c "exec 3>held; sleep 600"; exec 4<held')  # returns when the command has started
        self.assertEqual(done.returncode, 0, done.stderr)
        ended = select.poll()
        ended.register(reader, 0)  # POLLHUP: the last writer has closed the pipe
        self.assertEqual(ended.poll(60_000), [(reader, select.POLLHUP)])


class Programs(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.build = pathlib.Path(folder.name)
        (self.build / "tests").mkdir()
        self.failed = self.build / "failed"

    def program(self, name, kinds, ending):
        path = self.build / name
        path.write_text(PROGRAM.format(ending=ending))
        path.chmod(0o755)
        with open(self.build / "tests/programs", "a", encoding="utf-8") as file:
            file.write(f"{kinds} {path} argument\n")

    def run_programs(self, *arguments, **environment):
        environment = dict(os.environ) | {"SONARD_TEST_JOBS": "2", "SONARD_FAILED": str(self.failed), "RAN": str(self.build / "ran")} | environment
        return subprocess.run([sys.executable, TOOLS / "run_programs.py", self.build, *arguments], capture_output=True, text=True,
                              env=environment, check=False)

    def test_programs_are_listed_by_kind(self):
        self.program("one", "GTEST,LEVELS", "")
        self.program("two", "GTEST,LEVELS,FIGURES", "")
        self.program("three", "SANITIZED", "")
        self.assertEqual(self.run_programs("--list", "LEVELS", "SANITIZED", "--without", "FIGURES").stdout.split(), ["one", "three"])

    def test_programs_in_parts_run_first(self):
        self.program("short", "SANITIZED", "")
        self.program("long", "GTEST", "")
        done = self.run_programs("short", "long", SONARD_TEST_JOBS="1")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        ran = [line.partition(" ")[2] for line in (self.build / "ran").read_text().splitlines()]
        self.assertEqual(ran, ["part 0 of 2", "part 1 of 2", "part  of "])
        self.assertFalse(self.failed.exists())

    def test_parts_of_programs_alternate(self):
        for name in ("waits", "computes"):
            self.program(name, "GTEST", "")
        self.assertEqual(self.run_programs("waits", "computes", SONARD_TEST_JOBS="1").returncode, 0)
        ran = [line.partition(" ")[2] for line in (self.build / "ran").read_text().splitlines()]
        self.assertEqual(ran, ["part 0 of 2", "part 0 of 2", "part 1 of 2", "part 1 of 2"])

    def test_failed_programs_are_named_with_their_cases(self):
        self.program("asserts", "GTEST", 'echo "[  FAILED  ] Suite.Asserts (3 ms)"; exit 1')
        self.program("crashes", "GTEST", "kill -SEGV $$")
        self.program("fuzz", "SANITIZED", "exit 3")
        done = self.run_programs("asserts", "crashes", "fuzz", SONARD_TEST_JOBS="1")
        self.assertEqual(done.returncode, 1)
        self.assertIn("fuzz FAILED: it ended with 3", done.stdout)
        self.assertEqual(sorted(self.failed.read_text().splitlines()),
                         ["asserts: Suite.Asserts", "crashes: Suite.Ended", "fuzz: Suite.Ended"])

    def test_programs_that_hang_are_ended_and_named(self):
        self.program("hangs", "SANITIZED", "exec sleep 600")
        done = self.run_programs("hangs", SONARD_TEST_SECONDS="1")
        self.assertEqual(done.returncode, 1)
        self.assertIn("hangs FAILED: it took more than 1 s", done.stdout)
        self.assertRegex(self.failed.read_text(), "^hangs")

    def test_unknown_programs_are_refused(self):
        self.program("one", "GTEST", "")
        done = self.run_programs("other")
        self.assertEqual((done.returncode, done.stderr), (1, "no such test program: other; there are one\n"))

    def test_programs_that_are_not_built_fail(self):
        self.program("one", "SANITIZED", "")
        (self.build / "one").unlink()
        done = self.run_programs("one")
        self.assertEqual(done.returncode, 1)
        self.assertIn("one FAILED: it did not start: ", done.stdout)
        self.assertEqual(self.failed.read_text(), "one\n")


class Arm64(unittest.TestCase):
    def test_the_omitted_cases_exist(self):
        left_out = re.search(r"GTEST_FILTER=-(\S+)", (TOOLS / "arm64.sh").read_text())[1].split(":")
        sources = "".join(path.read_text() for path in (ROOT / "tests/core").rglob("*_test.cpp"))
        for case in left_out:
            suite, name = case.split(".")
            self.assertRegex(sources, rf"TEST(_F)?\({suite}, {name}\)")


class Times(unittest.TestCase):
    def test_the_slowest_and_the_failed_cases_are_listed(self):
        with tempfile.TemporaryDirectory() as folder:
            results = pathlib.Path(folder) / "tests.xml"
            cases = "".join(f'<testcase name="Suite.Case{n}" time="{n}" status="{"fail" if n in (2, 7) else "run"}"/>' for n in range(1, 13))
            results.write_text(f"<testsuite>{cases}</testsuite>")
            tell = [sys.executable, TOOLS / "test_times.py", results]
            slowest = subprocess.run(tell, capture_output=True, text=True, check=True).stdout.split("\n")
            failed = subprocess.run([*tell, "--failed"], capture_output=True, text=True, check=True).stdout.split()
        self.assertEqual((slowest[0], len(slowest) - 1), ("  12.0 s  Suite.Case12", 10))
        self.assertEqual(failed, ["Suite.Case2", "Suite.Case7"])


if __name__ == "__main__":
    unittest.main()
