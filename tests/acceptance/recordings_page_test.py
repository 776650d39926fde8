"""Tests recordings of every demo, played by sonard and by `sonard replay`, and on the page.

The tests of the page are skipped without browser or page.
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "view"))

import mcap_checker  # noqa: E402
from browser import Browser  # noqa: E402
from demos_test import DEMOS, HTTP, SONAR, UNCOVERED, demo, product_of  # noqa: E402
from foxglove_viewer import Refused, Viewer  # noqa: E402
from page_checks import WHY_NOT, PageChecks, shown  # noqa: E402
from recording_test import Replay  # noqa: E402
from running_sonard import SONARCTL, eventually, run  # noqa: E402

OWN = "/recording/trajectory/"
PATIENCE_S = 120


def is_message(topic):
    return lambda kind, value: kind == "message" and value[0] == topic


def record(maker, pings):
    """Records the running demo with sonarctl while a driver is connected; returns the file's path."""
    with subprocess.Popen([SONARCTL, "listen", f"{SONAR}:{DEMOS[maker][2]}", "--wait", "100", "--quiet"], stdout=subprocess.DEVNULL,
                          stderr=subprocess.DEVNULL) as driver:
        name = f"{maker}.mcap"
        assert run(SONARCTL, "recording", "start", name).returncode == 0
        eventually(lambda: more_than(pings), 300)
        assert run(SONARCTL, "recording", "stop").returncode == 0
        driver.terminate()
    return pathlib.Path("sonard-recordings") / name


def more_than(pings):
    words = run(SONARCTL, "status").stdout.split()
    return any(word.startswith("ping") and before.isdigit() and int(before) >= pings for before, word in zip(words, words[1:]))


class Recordings(PageChecks, unittest.TestCase):
    """Runs in a separate folder, in which demos create their recordings."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(folder.name)

    def look(self, viewer, kind, product):
        """Checks that the page names the product and plays, then seeks, pauses and plays again."""
        viewer.greeted().subscribe("/recording/picture", "/recording/fan", "/recording/ping", "/status")
        self.assertEqual(viewer.first_of("/recording/picture", PATIENCE_S)["kind"], kind)
        image = viewer.first_of("/recording/fan")
        self.assertGreater(max(image["data"]), 20, "an echo is visible")
        trajectory = viewer.first_of("/status")["vehicles"][0]["trajectory"]
        self.assertGreater(trajectory["duration_s"], 0)
        viewer.wait_for(lambda kind, value: kind == "word" and "playbackControl" in value.get("capabilities", ()) or viewer.info and
                        "playbackControl" in viewer.info["capabilities"])
        self.assertIn(product, viewer.info["metadata"].values())
        first_ns = viewer.info["dataStartTime"]["sec"] * 10**9 + viewer.info["dataStartTime"]["nsec"]

        def tell(name, value):
            viewer.say(op="setParameters", parameters=[{"name": OWN + name, "value": value, "type": "float64"} if name != "paused" else
                                                       {"name": OWN + name, "value": value}], id=name)
            return viewer.wait_for(lambda kind, word: kind == "word" and word["op"] == "parameterValues" and word.get("id") == name)

        def seek(position_s, is_there):
            tell("position_s", position_s)
            viewer.wait_for(lambda kind, value: is_message("/recording/ping")(kind, value) and is_there(value[1] - first_ns))

        def is_last(ns):
            return ns > 0.9e9 * trajectory["duration_s"]

        tell("paused", True)
        if any(is_last(ns - first_ns) for topic, ns, _ in viewer.messages[-20:] if topic == "/recording/ping"):
            seek(0.0, lambda ns: ns == 0)  # a short recording may have ended in the meantime; no ping is shown twice in succession
        seek(trajectory["duration_s"], is_last)
        seek(0.0, lambda ns: ns == 0)
        tell("speed", 4.0)
        tell("paused", False)
        viewer.wait_for(lambda kind, value: is_message("/recording/ping")(kind, value) and value[1] > first_ns)

    def test_every_demo_is_recorded_and_played(self):
        for maker, (kind, pings, port) in DEMOS.items():
            with self.subTest(demo=maker):
                with demo(maker) as daemon:
                    product = product_of(daemon)
                    path = record(maker, pings + 10)
                    with Viewer(HTTP, path=f"/?recording={path.name}") as viewer:
                        self.look(viewer, kind, product)
                # On a slow machine doctor and listen may last longer than the recording, whose end ends a replay without --loop.
                with Replay(path, "--loop") as replay, Viewer(HTTP) as viewer:
                    self.look(viewer, kind, product)
                    self.assertIn("open      http://127.0.0.1:8088", replay.text())
                    with urllib.request.urlopen("http://127.0.0.1:8088/healthz", timeout=PATIENCE_S) as answer:  # doctor requests it
                        self.assertEqual(answer.read(), f"ok: replays {path.name}\n".encode())
                    if maker == "oculus":
                        said = run(SONARCTL, "doctor").stdout
                        self.assertIn(f"returns ok: replays {path.name}", said)
                        self.assertNotIn("simulation", said, "a recording has its own rate")
                        self.assertNotIn("control stream", said, "a recording has no control stream")
                    if maker not in ("blueview", "ping360", "micron", "norbit"):
                        done = run(SONARCTL, "listen", f"{replay.address}:{port}", "--wait", "100", "--quiet", "--pings", 2)
                        self.assertIn("pings 2", done.stdout, "a driver is served beside the viewer: " + done.stderr)

    def test_a_recorded_refusal_of_another_request_stops_no_host(self):
        """A host that does not know the product at the port may send a request for another product first. Then the recording
        contains the refusal."""
        with demo("s500"):
            self.assertEqual(run(SONARCTL, "record", "--mcap", "run.mcap", "--wait", 100, "--pings", 20).returncode, 0)
        with Replay(pathlib.Path("run.mcap"), "--loop") as replay:
            done = run(SONARCTL, "listen", f"{replay.address}:51200", "--wait", "100", "--quiet", "--pings", 2)
            self.assertIn("pings 2", done.stdout, done.stderr)

    def test_recordings_of_sonarctl_have_name_and_poses_of_the_sonar(self):
        """Name and poses come from the sonard of this computer, although no --control names it."""
        with demo("oculus"):
            done = run(SONARCTL, "record", "--mcap", "run.mcap", "--wait", 100, "--pings", 20)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertNotIn("no poses", done.stderr)
        topics = {topic for topic, _, _ in mcap_checker.check(pathlib.Path("run.mcap").read_bytes()).messages}
        self.assertLessEqual({"/front/image", "/front/pose"}, topics)

    def test_only_files_of_the_folder_are_played(self):
        pathlib.Path("sonard-recordings").mkdir()
        pathlib.Path("sonard-recordings/broken.mcap").write_bytes(b"nothing")
        pathlib.Path("secret.mcap").write_bytes(b"nothing")
        with demo("oculus"):
            for name in ("..%2Fsecret.mcap", "%2Fetc%2Fpasswd", ".", "-x.mcap%2F"):
                with self.subTest(name), self.assertRaises(Refused):
                    Viewer(HTTP, path=f"/?recording={name}")
            for name in ("broken.mcap", "missing.mcap"):
                with self.subTest(name), Viewer(HTTP, path=f"/?recording={name}") as viewer:
                    viewer.wait_for(lambda kind, word: kind == "word" and "sonard.recording_failure" in word.get("metadata", {}))
            self.assertIn("broken.mcap  0.0 MB, of an earlier run", run(SONARCTL, "status").stdout)

    @unittest.skipIf(WHY_NOT, WHY_NOT)
    def test_the_page_plays_a_recording(self):
        with demo("oculus"), Browser() as browser:
            path = record("oculus", 20)
            for width, height, theme in ((1600, 1000, "dark"), (390, 844, "light")):
                with self.subTest(width=width):
                    page = self.opened(browser.open(f"http://{HTTP}:8088/", width, height, touch=width < 800, theme=theme))
                    shown(page)
                    if width < 800:
                        page.touch("#tabs [data-tab=clients]")
                    page.press_mouse(f"#recordings a[href='/?recording={path.name}']")
                    page.wait("document.body.classList.contains('plays')")
                    shown(page)
                    page.wait(UNCOVERED)
                    page.press(" ")
                    page.wait("document.querySelector('#play').getAttribute('aria-label') === 'Play'")
                    page.run("document.querySelector('#position').focus()")
                    page.press("Home")
                    page.wait("document.querySelector('#position-text').textContent === '0.0 s'")
                    number = page.text("#ping-number")
                    page.run("document.activeElement.blur()")
                    # On a busy computer, the next ping may be more than a second later.
                    eventually(lambda: page.press("ArrowRight") or page.text("#ping-number") != number)
                    self.picture(page, f"recording-{width}", 1)
                    self.assertLessEqual(page.run("document.documentElement.scrollWidth"), width)
                    self.assert_quiet(page, f"http://{HTTP}:8088/")
                    page.press_mouse("#live")
                    page.wait("!document.body.classList.contains('plays')")
                    if width < 800:
                        page.touch("#tabs [data-tab=fan]")
                    shown(page)
                    page.close()

    @unittest.skipIf(WHY_NOT, WHY_NOT)
    def test_the_player_sends_no_refused_request(self):
        with demo("3d15"), Browser() as browser:
            path = record("3d15", 5)
            page = self.opened(browser.open(f"http://{HTTP}:8088/?recording={path.name}", 1600, 1000))
            shown(page)
            page.wait("document.querySelector('#fan-glass').dataset.kind === 'range image'")
            page.press(" ")  # answers come in the order of the requests
            page.wait("document.querySelector('#play').getAttribute('aria-label') === 'Play'")
            self.assertEqual(page.run("document.querySelector('#refusal').innerText"), "")
            page.close()

    @unittest.skipIf(WHY_NOT, WHY_NOT)
    def test_a_recording_without_pings_is_not_offered(self):
        with demo("oculus"), Browser() as browser:
            page = self.opened(browser.open(f"http://{HTTP}:8088/", 1600, 1000))
            shown(page)
            page.run("document.querySelector('#record').focus()")
            page.press("Enter")
            page.wait("document.querySelector('#record').innerText === 'Stop recording' && document.querySelectorAll('#recordings li').length === 1")
            page.run("document.querySelector('#record').focus()")
            page.press("Enter")
            page.wait("document.querySelector('#recordings').innerText.includes('no pings: nothing to play')")
            self.assertIsNone(page.run("document.querySelector('#recordings a')"))
            page.close()

    @unittest.skipIf(WHY_NOT, WHY_NOT)
    def test_the_page_says_that_previews_are_not_recorded(self):
        with demo("oculus"), Browser() as browser:
            page = self.opened(browser.open(f"http://{HTTP}:8088/", 1600, 1000))
            shown(page)
            page.press_mouse("#record")
            page.wait("document.querySelector('#recordings')?.innerText.includes('waits for a driver, such as sonarctl listen')")
            with subprocess.Popen([SONARCTL, "listen", SONAR, "--wait", "100", "--quiet"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as driver:
                page.wait("/ [1-9]\\d* pings .* running/.test(document.querySelector('#recordings').innerText)")
                driver.terminate()
            # The page changes when the driver disconnects; a click at that moment may miss the button.
            page.wait("document.querySelector('#recordings').innerText.includes('waits for a driver, such as sonarctl listen')")
            page.press_mouse("#record")
            page.wait("document.querySelector('#record').innerText === 'Record'")
            page.close()


if __name__ == "__main__":
    unittest.main()
