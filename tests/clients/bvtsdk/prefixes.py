"""Paths of the libraries' prefixes and of the programs that use them in the build; the acceptance tests' daemon."""
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests/acceptance"))

from running_sonard import BUILD, Sonard, run  # noqa: E402,F401  pylint: disable=wrong-import-position,unused-import

PROGRAMS = BUILD / "tests/clients/bvtsdk/programs"


def prefix(abi):
    return BUILD / f"bvt{abi}"


def l_targets(**more):
    """Returns the daemon with a P900-90 in front of the L targets."""
    return Sonard(scene="l-targets.yaml", profile="blueview-p900-90", pose="{frame: ENU_FLU, xyz_m: [0, 0, 0]}", **more)
