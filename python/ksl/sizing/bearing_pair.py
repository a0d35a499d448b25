"""Two bearings on a joint's axis: what each of them carries, by statics."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from ksl.mechanism.states import Array
from ksl.sizing.figures import Formula

REACTIONS = Formula(
    "R_b = (M × k − a F)/(b − a), R_a = F − R_b, across the axis; the locating bearing carries all of the axial force",
    "equilibrium of forces and moments; k the axis, a and b the positions on it, F and M about the joint's origin",
)
OPPOSED = Formula(
    "Fa_A = max(S_A, S_B + K), Fa_B = max(S_B, S_A − K), S = e Fr; K: axial force towards A",
    "axial balance of two opposed rows; catalogues of angular contact bearings (induced force e Fr, 1.14 Fr at 40°)",
)


class Reactions(NamedTuple):
    """Radial reactions (n, 3) at two positions; they lie across the axis."""

    a: Array
    b: Array


def radial_reactions(force: Array, moment: Array, axis: Array, a: float, b: float) -> Reactions:
    """Splits forces and moments across an axis between two bearings on it.

    force, moment (n, 3): N, and N m about the point 0 of the axis; axis (3): its unit vector; a, b: positions of the bearings
    along it, m, which must differ.  The moment about the axis is not the bearings' to carry.  R_a + R_b = F and
    a k × R_a + b k × R_b = M, across the axis; since (k × R) × k = R for these, a R_a + b R_b = M × k.
    Raises ValueError where the positions are equal.
    """
    if a == b:
        raise ValueError("two bearings at the same position carry no moment; their positions must differ")
    across = force - (force @ axis)[:, None] * axis
    levers = np.cross(moment, axis)  # a R_a + b R_b
    at_b = (levers - a * across) / (b - a)
    return Reactions(across - at_b, at_b)


def opposed_axial_loads(radial_a: Array, radial_b: Array, towards_a: Array, e: float) -> tuple[Array, Array]:
    """Axial loads of two opposed single rows of angular contact bearings A and B, without preload, each (n), N.

    radial_a, radial_b (n): radial loads; towards_a (n): axial force of the shaft that presses it into A, negative into B.
    A radial load Fr pushes its bearing's rings apart with e Fr; the other bearing must hold that.  One of the two then
    carries its own induced force alone, the other that force and the external one.
    """
    induced_a, induced_b = e * np.abs(radial_a), e * np.abs(radial_b)
    return np.maximum(induced_a, induced_b + towards_a), np.maximum(induced_b, induced_a - towards_a)


def loaded_by_positive(a: float, b: float, arrangement: Literal["back-to-back", "face-to-face"]) -> Literal["a", "b"]:
    """Which of two opposed rows at positions a and b carries a force of the shaft along the positive axis.

    Face to face (X), the shaft's shoulder presses it into the further one; back to back (O), its nut pulls it into the
    nearer one, whose outer ring has its back towards the other bearing.
    """
    further: Literal["a", "b"] = "a" if a > b else "b"
    nearer: Literal["a", "b"] = "b" if further == "a" else "a"
    return further if arrangement == "face-to-face" else nearer
