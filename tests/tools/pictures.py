#!/usr/bin/env python3
"""Makes the pictures of README.md and docs/live-view.md again. Needs chromium, python3-pil and an idle computer:
the page shows rates and latency.

usage: build/release/tests/own_network/in_own_network tests/tools/pictures.py [--out FOLDER] [NAME...]
       NAME: live-view, live-view-phone, aris, ping360, sonar-3d15, data-set; default: all, into docs/. SONARD_BUILD: the build folder
"""
import argparse
import pathlib
import subprocess
import sys
import tempfile
import time

from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/acceptance"), str(ROOT / "tests/acceptance/view")]

from browser import Browser  # noqa: E402
from page_checks import shown  # noqa: E402
from running_sonard import SONARCTL, SONARD, Daemon, run  # noqa: E402

HTTP = "http://127.0.0.1:8088/"
# For each make: its demo, the vehicle's pose (east, north, up; roll, pitch, yaw in degrees), further options of sonarctl view.
VIEWS = {"aris": ("aris", "2.6,2.9,-3.2", "0,0,214.5", ()),
         "ping360": ("ping360", "0,0.6,-4.4", "0,0,0", ("--range", "8")),
         "sonar-3d15": ("3d15", "-7,0,-3", "0,0,0", ())}
# The page on an idle computer shows the rate that the driver requested, and no warning above the picture.
IDLE = "parseFloat(document.querySelector('#rate').textContent) > 9.5 && !document.querySelector('#badges').children.length"
IDLE_WITHIN_S = 60
WIDTH = 360
PAIR = (580, 163, 1160, 326)  # of the contact sheet: a ping beside its labels


def checked(*command, **options):
    done = run(*command, **options)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))}: {done.stderr}")
    return done


def keep(picture, path, colours):
    """Stores the picture with a palette, which takes a third of the bytes."""
    picture.convert("RGB").quantize(colours, Image.Quantize.MAXCOVERAGE, kmeans=4, dither=Image.Dither.NONE).save(path, optimize=True)
    print(f"{path}: {picture.width} x {picture.height}, {path.stat().st_size / 1000:.0f} kB")


def page(path, width, height):
    """Takes a picture of the page: the demo with one driver at 10 Hz, after ten seconds."""
    with Daemon(None, str(SONARD)), Browser() as browser, \
            subprocess.Popen([SONARCTL, "listen", "--rate", "10", "--quiet"], stdout=subprocess.DEVNULL) as driver:
        try:
            opened = browser.open(HTTP, width, height, scale=2, touch=width < 800)  # the scene of a software renderer has half the pixels
            shown(opened)
            time.sleep(10)
            opened.wait(IDLE, IDLE_WITHIN_S)
            opened.picture(path)
            opened.close()
        except AssertionError:
            raise SystemExit(f"{path}: the computer is busy, and the page shows {opened.text('#rate')}: repeat it later") from None
        finally:
            driver.terminate()
    keep(Image.open(path).resize((width, height), Image.Resampling.LANCZOS), path, 256)


def view(path, maker, place, turn, more):
    with Daemon(None, str(SONARD), [maker]):
        checked(SONARCTL, "pose", "once", "--xyz", place, "--rpy", turn, "--confirm")
        checked(SONARCTL, "view", "--png", path, "--width", WIDTH, *more)
    picture = Image.open(path).convert("RGB")
    if maker == "aris":  # the picture below its window is empty
        picture = picture.crop((0, 0, picture.width, int(0.68 * picture.height)))
    keep(picture, path, 32)


def data_set(path):
    """Cuts one ping of mines.yaml and its labels out of the contact sheet."""
    with tempfile.TemporaryDirectory() as folder:
        checked(SONARD, "dataset", ROOT / "scenes/datasets/mines.yaml", "--out", pathlib.Path(folder) / "mines", "--quiet", patience_s=600)
        sheet = Image.open(pathlib.Path(folder) / "mines/contact.png")
        sheet.load()
    keep(sheet.crop(PAIR), path, 128)


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "docs")
    parser.add_argument("names", nargs="*", metavar="NAME")
    given = parser.parse_args()
    makers = {"live-view": lambda path: page(path, 1440, 900), "live-view-phone": lambda path: page(path, 390, 844),
              **{name: lambda path, about=about: view(path, *about) for name, about in VIEWS.items()}, "data-set": data_set}
    for name in given.names or makers:
        if name not in makers:
            parser.error(f"there is no picture {name}")
        makers[name](given.out / f"{name}.png")


if __name__ == "__main__":
    main()
