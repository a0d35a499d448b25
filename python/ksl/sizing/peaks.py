"""The simultaneous set at each peak: what acts together when one of axial, radial, bending, torque or speed is extreme."""

from __future__ import annotations

import numpy as np

from ksl.mechanism.states import Array
from ksl.sizing.samples import JointSamples

QUANTITIES = {
    "axial_force": "N",
    "radial_force": "N",
    "bending_moment": "N m",
    "axial_moment": "N m",
    "effort": "N m or N",
    "speed": "rad/s or m/s",
    "position": "rad or m",
}
"""Columns and units; forces and moments are those on the child, at the point."""

EXTREMES = (
    ("axial_force", "max"), ("axial_force", "min"), ("radial_force", "max"), ("bending_moment", "max"),
    ("axial_moment", "max"), ("axial_moment", "min"), ("effort", "max"), ("effort", "min"), ("speed", "max"), ("speed", "min"),
)  # fmt: skip

PeakRow = dict[str, "str | float | None"]


def simultaneous_sets(samples: JointSamples) -> list[PeakRow]:
    """A row for each extreme of a joint: which one, the set at that sample, unit of the position, case, time and point.

    Signed quantities have their largest and their smallest value.  Separate magnitudes can't be checked against a
    catalogue, whose limits hold for loads that act together.
    """
    s = samples
    curves: dict[str, Array] = {name: getattr(s, name) for name in QUANTITIES}
    rows: list[PeakRow] = []
    for quantity, which in EXTREMES:
        x = curves[quantity]
        if not np.isfinite(x).any():  # joints without one coordinate have neither effort nor speed
            continue
        k = int(np.nanargmax(x) if which == "max" else np.nanargmin(x))
        case, time = s.where(k)
        numbers = {name: float(c[k]) if np.isfinite(c[k]) else None for name, c in curves.items()}
        point = " ".join(f"{c:g}" for c in s.point)
        unit = None if not s.joint.driven else "rad" if s.joint.turns else "m"
        rows.append({"joint": s.joint.name, "extreme": f"{quantity} {which}", **numbers, "unit": unit, "case": case, "time": time, "point": point})
    return rows
