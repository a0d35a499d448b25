"""The example legs, and maps of their joints."""

import warnings
from functools import cache
from pathlib import Path

import ksl

ROBOTS = Path(__file__).resolve().parents[2] / "examples" / "robots"
JOINTS = {
    "two_rod_ankle": ["ankle_pitch", "ankle_roll"],
    "four_bar_knee": ["knee"],
    "differential_wrist": ["lift", "roll"],
    "three_rod_platform": ["heave", "pitch", "roll"],
}


@cache
def model(name, *physics, folder=ROBOTS):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ksl.DescriptionWarning)  # spherical is no kind of URDF's
        return ksl.load(folder / f"{name}.urdf", physics=physics or None)


@cache
def leg(name, *physics):
    return model(name, *physics).actuation(JOINTS[name])
