"""The makes of sonar whose pings the judge reads."""
from __future__ import annotations

from typing import Optional

from ..truth import Make
from . import aris, blueview, dvl, m3, micron, norbit, oculus, ping, waterlinked

MAKES = (oculus.OCULUS, blueview.BLUEVIEW, ping.NUMBERED, ping.UNNUMBERED, ping.SURVEYOR, m3.M3, micron.MICRON,
         norbit.NORBIT, dvl.DVL, aris.ARIS, waterlinked.WATERLINKED)


def make_of(profile: str) -> Optional[Make]:
    """Returns the make of a product; None if its data cannot be judged."""
    return next((make for make in MAKES if profile.startswith(make.profiles)), None)
