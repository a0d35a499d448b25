"""Buckling of round bars under a central force: Euler's formula, and below its range the straight lines of Tetmajer."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ksl.mechanism.states import Array
from ksl.sizing.figures import Formula

TETMAJER = {"S235": (310e6, 1.14e6, 104.0), "E335": (335e6, 0.62e6, 88.0)}
"""{steel: (a, b, limit slenderness)}: critical stress a − b λ, Pa, below the limit slenderness."""

BUCKLING = Formula(
    "λ = 4 β L/d; F_k = π² E I/(β L)² from the limit slenderness on, below it (a − b λ) π d²/4; I = π d⁴/64; safety F_k/F_push",
    "Euler (1744); Tetmajer (1890), lines of S235 and E335 as in textbooks (Dubbel, Roloff/Matek); the whole length has the rod's section, "
    "which is on the safe side of ISO/TS 13725",
)


def critical_force(length: ArrayLike, diameter: float, material: str = "E335", modulus: float = 2.1e11, factor: float = 1.0) -> Array:
    """Force, N, at which a round bar of a length (…), m, buckles; factor: buckling length over length, 1 for pins at both ends."""
    buckling = factor * np.asarray(length, dtype=float)
    slenderness = 4 * buckling / diameter
    a, b, limit = TETMAJER[material]
    with np.errstate(divide="ignore"):
        euler = math.pi**3 * modulus * diameter**4 / 64 / buckling**2
    return np.where(slenderness >= limit, euler, (a - b * slenderness) * math.pi * diameter**2 / 4)
