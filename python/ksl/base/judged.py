"""Numbers of files by what they measure: each is finite and within bounds that nothing built goes beyond, or a sentence names it.

A number outside of them is a mistake of the file or of what wrote it; taken as it is, it ends as NaN, or as a result that nothing doubts."""

from __future__ import annotations

import math
from typing import NamedTuple


class Bounds(NamedTuple):
    """A quantity's least and most, whether 0 may stand for "none", and the sign."""

    least: float
    most: float
    unit: str = ""
    zero: bool = False
    """0 is allowed."""
    signed: bool = False
    """The bounds are of the magnitude."""


LENGTH_UNIT = Bounds(1e-9, 1e9, "m")
"""A unit of length, from a nanometre to a million kilometres."""
MASS_UNIT = Bounds(1e-12, 1e9, "kg")
"""A unit of mass, from a nanogram to a million tonnes."""
RATE = Bounds(1e-6, 1e9, "a second")
"""Time codes, frames or samples in a second."""
MASS = Bounds(1e-15, 1e12, "kg", zero=True)
DENSITY = Bounds(1e-6, 1e8, "kg/m³", zero=True)
"""Osmium has 22,590 kg/m³; files give thin shells more."""
MOMENT = Bounds(1e-30, 1e18, "kg m²", zero=True)
SCALE = Bounds(1e-9, 1e9, signed=True)
RATIO = Bounds(1e-9, 1e9, signed=True)
"""Ratios of gears and mimic joints: 0 would hold the follower still."""
LENGTH = Bounds(0.0, 1e9, "m", zero=True, signed=True)


class OutOfBounds(ValueError):
    """A number of a file that can't be what it says it is."""


def judged(x: float, what: str, bounds: Bounds) -> float:
    """x, if it is within the bounds; otherwise OutOfBounds, which says what it is and what is expected."""
    size = abs(x) if bounds.signed else x
    if math.isfinite(x) and (bounds.least <= size <= bounds.most or (bounds.zero and x == 0)):
        return x
    unit = f" {bounds.unit}" if bounds.unit else ""
    expected = f"{'a magnitude of ' if bounds.signed else ''}{bounds.least:g} to {bounds.most:g}{unit}{', or 0' if bounds.zero and bounds.least else ''}"
    raise OutOfBounds(f"{what} is {x:g}{unit}; expected {expected}; correct it in the file")
