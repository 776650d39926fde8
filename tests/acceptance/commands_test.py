"""Tests errors of the command lines: one sentence that states what, where and what to do, and the exit code of its kind."""
import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

from running_sonard import BUILD, ROOT, SONARCTL, SONARD, Sonard, eventually, run


def check(text):
    with tempfile.TemporaryDirectory() as folder:
        config = pathlib.Path(folder) / "test.yaml"
        config.write_text(text, encoding="utf-8")
        return run(SONARD, "check", config)


GOOD = f"""\
world: {{scene: {ROOT}/scenes/demo.yaml}}
vehicles: [{{name: rov}}]
sonars: [{{name: front, profile: oculus-m1200d, bind_ip: 127.0.0.2}}]
"""


class Help(unittest.TestCase):
    def test_every_command_explains_itself(self):
        for command in [(SONARD,), (SONARD, "run"), (SONARD, "check"), (SONARD, "render"), (SONARD, "dataset"), (SONARD, "worker"), (SONARD, "farm"), (SONARCTL,), (SONARCTL, "listen"), (SONARCTL, "view"),
                        (SONARCTL, "stats"), (SONARCTL, "pose"), (SONARCTL, "pose", "circle")]:
            with self.subTest(command=command):
                result = run(*command, "--help")
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertIn("Usage", result.stdout)

    def test_every_command_of_sonard_gives_examples(self):
        for words in [[], ["run"], ["check"], ["render"], ["dataset"], ["worker"], ["farm"]]:
            self.assertIn("examples:", run(SONARD, *words, "--help").stdout)

    def test_every_command_of_sonarctl_gives_examples(self):
        commands = run(SONARCTL, "--help").stdout.split("Subcommands:\n")[1].split("\n\n")[0]
        names = [line.split()[0] for line in commands.splitlines() if line.startswith("  ") and line[2] != " "]
        for name in ["doctor", "status", "listen", "view", "stats", "pose", "events", "set", "load", "object"]:
            self.assertIn(name, names)
        for words in [[], *([name] for name in names), ["set", "sonar"], ["set", "water"], ["object", "add"]]:
            with self.subTest(words=words):
                self.assertIn("examples:", run(SONARCTL, *words, "--help").stdout)

    def test_output_that_is_lost_is_an_error(self):
        for command in [(SONARD, "--help"), (SONARCTL, "--help"), (SONARCTL, "scene", "info", ROOT / "scenes/demo.yaml")]:
            words = [str(c) for c in command]
            with self.subTest(command=words), open("/dev/full", "w", encoding="utf-8") as full:
                result = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, timeout=120, check=False)
                self.assertEqual(result.returncode, 74)
                self.assertIn("standard output cannot be written", result.stderr)
            with self.subTest(reader="gone", command=words), subprocess.Popen(words, stdout=subprocess.PIPE) as gone:
                gone.stdout.close()
                self.assertIn(gone.wait(120), (0, -signal.SIGPIPE))

    def test_version(self):
        self.assertRegex(run(SONARD, "--version").stdout, r"^sonard \d+\.\d+\.\d+\nhot loops: (portable|avx2|avx512|neon)\n$")
        self.assertEqual(run(SONARCTL, "--version").stdout.split()[1], run(SONARD, "--version").stdout.split()[1])


@unittest.skipIf(shutil.which("localedef") is None, "there is no localedef")
class Languages(unittest.TestCase):
    def test_a_decimal_comma_changes_nothing(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            if not run("localedef", "-i", "de_DE", "-f", "UTF-8", folder / "de_DE.UTF-8").returncode == 0:
                self.skipTest("the definition of de_DE is not installed")
            (folder / "box.obj").write_text("v 0.25 0.5 0.75\nv 1.5 0.5 0.75\nv 0.25 1.625 0.75\nv 0.25 0.5 2.125\n"
                                            "f 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n", encoding="utf-8")
            (folder / "scene.yaml").write_text("objects: [{name: box, type: mesh, file: box.obj, scale: 1.25, material: steel,"
                                               " pose: {xyz_m: [2.5, 0, -5.5]}}]\n", encoding="utf-8")
            (folder / "sonard.yaml").write_text("world: {scene: scene.yaml}\nvehicles: [{name: rov, initial_pose:"
                                                " {frame: ENU_FLU, xyz_m: [0, 0, -4.5]}}]\nsonars:"
                                                " [{name: front, profile: ping360, bind_ip: 127.0.0.2}]\n", encoding="utf-8")
            found = {}
            for language, point in (("C", "."), ("de_DE.UTF-8", ",")):
                speaking = ("env", f"LOCPATH={folder}", f"LC_ALL={language}")
                self.assertEqual(run(*speaking, "locale", "decimal_point").stdout.strip(), point)
                checked = run(*speaking, SONARCTL, "scene", "check", folder / "scene.yaml")
                self.assertIn("x 2.81..4.38", checked.stdout)
                out = folder / language[:1]
                made = run(*speaking, SONARD, "render", folder / "sonard.yaml", "--out", out, "--pings", "1")
                self.assertEqual(made.returncode, 0, made.stderr)
                found[language] = checked.stdout, {file.name: file.read_bytes() for file in out.iterdir()}
            self.assertEqual(*found.values())


class Mistakes(unittest.TestCase):
    def expect(self, result, code, *words):
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        for word in words:
            self.assertIn(word, result.stderr)

    def test_options_of_another_vendor_are_reported(self):
        text = (ROOT / "scenes/sonard.yaml").read_text(encoding="utf-8")
        for profile, notes in (("oculus-m1200d", 0), ("blueview-p900-90", 2)):
            result = check(text.replace("profile: oculus-m1200d", f"profile: {profile}"))
            self.expect(result, 0)
            self.assertEqual(result.stdout.count("is for Oculus sonars: without effect on BlueView P900-90"), notes, result.stdout)

    def test_usage_is_64(self):
        self.expect(run(SONARD, "--no-such-option"), 64, "--no-such-option")
        self.expect(run(SONARCTL), 64, "Usage: sonarctl", "doctor", "status", "listen", "view")
        self.expect(run(SONARCTL, "veiw"), 64, 'unknown command "veiw"; did you mean "view"?')
        self.expect(run(SONARCTL, "pose"), 64, "once, circle, line")
        self.expect(run(SONARCTL, "pose", "once", "--xzy", "0,0,0"), 64, 'did you mean "--xyz"?', "sonarctl pose once --help")
        self.expect(run(SONARCTL, "listen", "--rate", "often"), 64, "--rate")
        self.expect(run(SONARCTL, "view", "--png", "x.png", "--from-raw", "y", "--colour-map", "pink"), 64, "gray, copper")
        self.expect(run(SONARCTL, "listen", "127.0.0.1:port"), 64, "127.0.0.1:port", "HOST:PORT")

    def test_an_empty_word_is_64(self):
        for command in ([SONARD, "run", ""], [SONARD, ""], [SONARCTL, "listen", ""]):
            self.expect(run(*command), 64, "it is empty: write a value, or leave it out")

    def test_names_that_would_move_the_cursor_are_escaped(self):
        for command in ([SONARD, "check", "\x1b[2J"], [SONARD, "\x1b[2J"], [SONARCTL, "scene", "check", "\x1b[2J"], [SONARCTL, "listen", "\x1b[2J"]):
            result = run(*command)
            self.assertIn("\\x1b[2J", result.stderr)
            self.assertNotIn("\x1b", result.stderr)
            self.assertGreater(result.returncode, 0)

    def test_a_wrong_command_line_gets_one_line(self):
        words = [(["--threads", "abc"], "--threads", '"abc" is not a whole number from 0 to 256'),
                 (["run", "--threads", "257"], "--threads", '"257" is not a whole number from 0 to 256', "sonard run --help"),
                 (["run", "--seed", "0x10"], "--seed", '"0x10" is not a whole number'),
                 (["--mode", "raser"], "--mode", '"raser" is not one of: canonical, paper, raster'),
                 (["run", "--threds", "2"], "--threds", 'did you mean "--threads"?'),
                 (["run", "a.yaml", "b.yaml"], 'unexpected argument "b.yaml"'),
                 (["run", "--clock"], "--clock: 1 required"),
                 (["--demo", "my.yaml"], "--demo runs the built-in demo, not my.yaml"),
                 (["--demo=maybe"], 'there is no demo "maybe"; there are oculus, blueview, aris, 3d15, ping360, surveyor, omniscan, ping1d, s500, dvl, m3, micron, norbit, and'),
                 (["--profile", "blueview-p900"], "--profile: unknown profile 'blueview-p900'", "oculus-m370s", "blueview-mb2250-90"),
                 (["chekc"], 'no command or file "chekc"; did you mean "check"?'),
                 (["check"], "sonard: config is required: the configuration file", "sonard check --help"),
                 (["render"], "a configuration or render file", "sonard render --help"),
                 (["render", "x.yaml", "--out", "d", "--rate", "often"], "--rate", '"often" is not a number from 0.001 to 10000'),
                 (["bench", "--case", "P1"], "the benchmark is a program of its own, sonard_bench"),
                 (["--bind", "localhost", "--demo"], "--bind", '"localhost" is not an IPv4 address')]
        for line, *expected in words:
            with self.subTest(sonard=line):
                self.expect_one_line("sonard: ", run(SONARD, *line), *expected)
        words = [(["listen", "--rate", "often"], "--rate", '"often" is not', "standby", "sonarctl listen --help"),
                 (["listen", "--make", "sonar"], "--make", "oculus, blueview, aris"),
                 (["listen", "--seconds", "long"], "--seconds", '"long" is not a number of 0 or more'),
                 (["listen", "--range", "5", "--range-percent", "5"], "--range excludes --range-percent"),
                 (["listen", "127.0.0.1:port"], '"127.0.0.1:port" is not an address: write HOST:PORT'),
                 (["status", "--control", "127.0.0.1:0"], "--control", '"127.0.0.1:0" is not an address'),
                 (["doctor", "--within", "0"], "--within", '"0" is not a number from 1 to 600'),
                 (["pose", "once", "--frame", "nde"], "--frame", '"nde" is not one of: enu, ned'),
                 (["pose", "once", "--xyz", "1,2"], "--xyz: At least 3 required"),
                 (["set", "sonar", "--mode", "high"], "--mode", '"high" is not a whole number'),
                 (["load"], "sonarctl: SCENE is required: scene file"), (["scene"], "a command is required: check, info, import"),
                 (["view", "--png", "x.png", "--colour-map", "pink"], "--colour-map", "gray, copper")]
        for line, *expected in words:
            with self.subTest(sonarctl=line):
                self.expect_one_line("sonarctl: ", run(SONARCTL, *line), *expected)

    def expect_one_line(self, start, result, *words):
        self.expect(result, 64, *words)
        self.assertTrue(result.stderr.startswith(start), result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        self.assertEqual(result.stdout, "")

    def test_a_good_configuration_is_0(self):
        self.expect(check(GOOD), 0)

    def test_check_lists_the_addresses_for_drivers(self):
        for profile, lines in (("oculus-m1200d", ["sonar front, Oculus M1200d", "  tcp        127.0.0.2:52100            settings, pings; waits for the driver",
                                                  "  status     127.255.255.255:52102      address, state; sent without a request"]),
                               ("norbit-wbms", ["  tcp        127.0.0.2:2211             water column; waits for the driver"])):
            said = check(GOOD.replace("oculus-m1200d", profile)).stdout.splitlines()
            self.assertEqual([line for line in lines if line not in said], [], said)

    def test_a_mistyped_key_is_78_and_the_nearest_one_is_named(self):
        self.expect(check(GOOD.replace("bind_ip", "bind_op")), 78, "test.yaml:3:", "bind_op", 'did you mean "bind_ip"')

    def test_an_unknown_profile_and_a_missing_scene_are_reported(self):
        self.expect(check(GOOD.replace("m1200d", "m1200")), 78, "oculus-m1200d")
        self.expect(check(GOOD.replace("demo.yaml", "demi.yaml")), 78, "test.yaml:1:", "world.scene", "no such file")

    def test_a_token_that_cannot_be_used_is_78(self):
        with tempfile.TemporaryDirectory() as folder:
            token = pathlib.Path(folder) / "token"
            text = GOOD + f"control: {{token_file: {token}}}\n"
            self.expect(check(text), 78, "control.token_file", "cannot be read; make one")
            token.write_text("short\n", encoding="utf-8")
            self.expect(check(text), 78, "control.token_file", "at least 16 characters")
            token.write_text("abcdefgh01234567\n", encoding="utf-8")
            self.expect(check(text), 0)

    def test_a_broken_scene_is_65_with_its_place(self):
        with tempfile.TemporaryDirectory() as folder:
            scene = pathlib.Path(folder) / "scene.yaml"
            scene.write_text("objects:\n  - {name: a, sphere: {radius_m: -1}}\n", encoding="utf-8")
            self.expect(check(GOOD.replace(f"{ROOT}/scenes/demo.yaml", str(scene))), 65, "scene.yaml:")

    def test_missing_files_are_66_and_absent_devices_69(self):
        self.expect(run(SONARD, "run", BUILD / "none.yaml"), 66, "none.yaml")
        self.expect(run(SONARCTL, "view", "--png", "x.png", "--from-raw", BUILD / "none.raw"), 66, "none.raw")
        self.expect(run(SONARCTL, "listen", "127.0.0.9", "--wait", "0.1"), 69, "Is sonard running there?")

    def test_limits_of_the_machine_are_named(self):
        def short_of(limit):
            return run("bash", "-c", f"{limit}; exec {SONARD} run --demo")

        for kib in range(80_000, 130_000, 10_000):  # from about 160 MB on it may run
            short = short_of(f"ulimit -v {kib}")
            if short.returncode != 127:
                self.expect(short, 69, "memory")
        # Where memory does not suffice for the libraries, the dynamic loader ends the program. From 290 MB on, the ray tracer starts
        # its threads, and needs some MB for each.
        for program, *words in ((SONARD, "check", ROOT / "scenes/sonard.yaml"), (SONARCTL, "scene", "check", ROOT / "scenes/demo.yaml")):
            for kib in (*range(80_000, 290_000, 30_000), *range(290_000, 350_000, 6_000), 400_000):
                result = run("bash", "-c", f"ulimit -v {kib}; exec \"$@\"", "-", program, *words)
                with self.subTest(kib=kib, program=program.name):
                    if result.returncode not in (0, 127):
                        self.expect(result, 69, "memory", "ulimit -v")
        for kib in (64, 256, 1023):
            for program, *words in ((SONARD, "run", "--demo"), (SONARD, "check", "--demo"), (SONARCTL, "--version"),
                                    (SONARCTL, "scene", "check", "demo.yaml")):
                self.expect(run("bash", "-c", f"ulimit -s {kib}; exec \"$@\"", "-", program, *words), 69,
                            f"the stack is limited to {kib} KiB, and at least 1024 are needed; raise the limit (ulimit -s")
        for limit in ("ulimit -S -s 64", "ulimit -s 1024"):  # sonarctl may raise the first one
            result = run("bash", "-c", f"{limit}; exec {SONARCTL} scene check {ROOT}/scenes/demo.yaml")
            self.assertEqual((result.returncode, result.stderr), (0, ""), limit)
        if os.geteuid() != 0:  # the superuser has no such limit
            self.expect(short_of("ulimit -u 1"), 69, "cannot start a thread", "ulimit -u")

    def test_a_token_from_a_fifo_is_refused_without_waiting(self):
        with tempfile.TemporaryDirectory() as folder:
            os.mkfifo(pathlib.Path(folder) / "token")
            for command in (["status"], ["recording", "start", "a.mcap"], ["fault", "list"]):
                result = run(SONARCTL, *command, "--token-file", pathlib.Path(folder) / "token", patience_s=60)
                self.expect(result, 66, "cannot read a token from")

    def test_an_address_of_another_machine_is_69_with_the_remedy(self):
        self.expect(run(SONARD, "run", "--demo", "--bind", "192.0.2.7"), 69, "192.0.2.7", "--bind")


class Interrupted(unittest.TestCase):
    def ends_soon(self, process):
        begin = time.monotonic()
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=120)
        self.assertLess(time.monotonic() - begin, 10)

    def started(self, *words):
        """Starts sonarctl; returns its process when the handler of SIGTERM is in place."""
        process = subprocess.Popen([SONARCTL, *words], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                   text=True)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        status = pathlib.Path(f"/proc/{process.pid}/status")
        eventually(lambda: int(status.read_text().split("SigCgt:")[1].split()[0], 16) >> signal.SIGTERM - 1 & 1)
        return process

    def test_the_first_signal_ends_the_search_for_a_sonar(self):
        for words in (["listen", "127.0.0.77"], ["view", "127.0.0.77", "--png", "x.png"], ["stats", "127.0.0.77"],
                      ["listen", "127.0.0.77", "--make", "waterlinked"]):
            with self.subTest(words):
                process = self.started(*words, "--wait", "60")
                self.ends_soon(process)
                self.assertGreater(process.returncode, 0)  # no signal ended it

    def test_the_first_signal_ends_the_wait_for_a_sonar_that_is_gone(self):
        with Sonard() as daemon:
            process = self.started("listen", daemon.address, "--wait", "60")
            eventually(lambda: re.search(r"^sonard_pings_sent_total\S* [1-9]", daemon.get("/metrics"), re.M))
            daemon.process.kill()
            eventually(lambda: "connecting again" in process.stderr.readline())
            self.ends_soon(process)
            self.assertEqual(process.returncode, 0)


class CheckAndRun(unittest.TestCase):
    """`sonard check` refuses what `sonard run` refuses before it opens a socket, with the same code and sentence."""

    def refused(self, text, code, *words, files=None):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            for file, contents in (files or {}).items():
                (folder / file).write_text(contents, encoding="utf-8")
            os.mkfifo(folder / "fifo")
            config = folder / "test.yaml"
            config.write_text(text, encoding="utf-8")
            results = [run(SONARD, command, config, patience_s=300) for command in ("run", "check")]
        for result in results:
            self.assertEqual(result.returncode, code, result.stdout + result.stderr)
            for word in words:
                self.assertIn(word, result.stderr)
        ran, checked = (result.stderr.splitlines()[-1] for result in results)
        self.assertEqual(ran, checked)

    def test_check_and_run_refuse_mistakes_in_the_configuration_alike(self):
        for more, code, *words in [
                ("faults: {plan: [{do: L05}]}", 78, "faults.plan: faults act only when they are armed"),
                ("faults: {armed: true, plan: [{do: L99}]}", 78, "is not a fault"),
                ("faults: {armed: true, plan: [{do: U02, sonar: stern}]}", 78, 'sonar "stern" is unknown'),
                ("faults: {armed: true, plan: [{do: L05, at: {every: 1, phase: 5}}]}", 78, "phase must be below every"),
                ("faults: {armed: true, journal: missing/j.jsonl}", 74, "journal of faults cannot be written", "missing is not a folder"),
                ("faults: {armed: true, journal: fifo}", 74, "no program reads this FIFO"),
                ("faults: {armed: true, journal: .}", 74, "Is a directory"),
                ("clock: lockstep\ncontrol: {stream: off, http: off}", 78, "leave one on"),
                ("clock: follow\ncontrol: {stream: off, http: off}\nposes: {protobuf: off, json: off}", 78, "leave one on"),
                ("control: {token_file: none}", 78, "cannot be read; make one"),
                ("control: {token_file: fifo}", 78, "control.token_file", "is a FIFO, not a regular file"),
                ("control: {token_file: short}", 78, "at least 16 characters"),
                ("control: {http: \"192.0.2.7:8088\"}", 78, "needs control.token_file"),
                ("recording: {folder: missing}", 78, "is not a folder"),
                ("recording: {folder: /proc}", 78, "recording.folder", "the kernel's own files"),
                ("recording: {folder: /sys/kernel}", 78, "recording.folder", "the kernel's own files"),
                ("faults: {armed: true, journal: /proc/j.jsonl}", 74, "/proc contains only the kernel's own files"),
                ("objects: [{name: wreck, trajectory: orbit}]", 78, "objects[0]"),
                ("engine: {mode: paper, multipath: on}", 78, "multipath"),
                ("limits: {clients: 0}", 78, "limits.clients"),
                ("nonsense: 1", 78, "nonsense")]:
            with self.subTest(more=more):
                self.refused(GOOD + more + "\n", code, *words, files={"short": "x\n"})

    def test_two_listeners_at_one_port(self):
        same = "poses: {json: \"127.0.0.1:15771\"}\ncontrol: {http: \"127.0.0.1:15771\"}\n"
        self.refused(GOOD + same, 78, "poses.json and control.http would both listen at 127.0.0.1:15771")
        self.refused(GOOD + "poses: {json: \"127.0.0.2:52100\"}\n", 78, 'sonar "front" and poses.json would both listen')
        host = GOOD.replace("bind_ip: 127.0.0.2}", "bind_ip: 127.0.0.2}, {name: altimeter, profile: ping1d, bind_ip: 127.0.0.4}")
        self.refused(host + "poses: {mavlink: \"udpin:127.0.0.4:9090\"}\n", 78, 'sonar "altimeter" and poses.mavlink would both listen')
        scanner = GOOD.replace("oculus-m1200d", "ping360")
        self.refused(scanner + "poses: {mavlink: \"udpin:127.0.0.2:30303\"}\n", 78, 'sonar "front" and poses.mavlink would both listen')
        shared = scanner.replace("bind_ip: 127.0.0.2}", "bind_ip: 127.0.0.2}, {name: rear, profile: ping360, bind_ip: 127.0.0.3}")
        self.assertEqual(check(shared).returncode, 0, "sonars share the port at which hosts look for them")
        two = GOOD.replace("bind_ip: 127.0.0.2}", "bind_ip: 127.0.0.2}, {name: rear, profile: oculus-m750d, bind_ip: 0.0.0.0, advertise_ip: 127.0.0.3}")
        self.refused(two, 78, 'sonar "front" and sonar "rear" would both listen at 0.0.0.0:52100')

    def test_the_scene(self):
        def with_scene(text):
            return GOOD.replace(f"{ROOT}/scenes/demo.yaml", text)

        self.refused(with_scene("none.yaml"), 78, "world.scene", "no such file")
        self.refused(with_scene("fifo"), 78, "world.scene")
        self.refused(with_scene("scene.yaml"), 65, "scene.yaml:1:", files={"scene.yaml": "objects: [{name: a, sphere: {radius_m: -1}}]\n"})
        self.refused(with_scene("scene.yaml"), 65, "no mesh file at", files={"scene.yaml": "objects: [{name: a, type: mesh, file: a.obj, material: sand}]\n"})

    def test_the_engine(self):
        if pathlib.Path("/dev/nvidiactl").exists():
            self.skipTest("there is a graphics processor")
        self.refused(GOOD + "engine: {device: cuda}\n", 69, "use --engine cpu or auto")


if __name__ == "__main__":
    unittest.main()
