"""Pins and plain bushes: stresses, pressures and wear, by the usual closed formulas."""

from __future__ import annotations

import math

import numpy as np

from ksl.mechanism.states import Array
from ksl.sizing.figures import Formula

TEXTBOOKS = "textbooks of machine elements (Roloff/Matek, pins: loose in fork and eye)"
SHARES = Formula("R = max |F/2 ± M × k/L|, L from middle to middle", "statics")
BENDING = Formula("σ = R (b/2 + g + t/4)/W, W = π (d⁴ − d_i⁴)/(32 d)", f"{TEXTBOOKS}: M = F (t + 2 b + 4 g)/8 for R = F/2")
SHEAR = Formula(
    "τ = 4/3 R/A (d² + d d_i + d_i²)/(d² + d_i²), A = π (d² − d_i²)/4", "largest shear stress of a round section (Gere, Timoshenko: Mechanics of Materials)"
)
PRESSURE = Formula("p = F/(d t) + 6 M/(d t²)", "pressure on the projected area, linear along the width")
CHEEK = Formula("p = R/(d b)", "pressure on the projected area")
SPEED = Formula("v = |ω| d/2", "kinematics")
PV = Formula("mean of p v over the cycle", "catalogues of plain bearings")
PV_SHORT = Formula("max p v", "catalogues of plain bearings")
WEAR = Formula("h = k ∫ p v dt; life = allowed depth/h of one hour", "Archard, J. Appl. Phys. 24 (1953) 981")


def shares(force: Array, moment: Array, axis: Array, spacing: float) -> Array:
    """(n): the larger of the forces, N, on two supports on an axis, a spacing (m) apart, with force (n, 3) and moment (n, 3) about the middle."""
    across = force - (force @ axis)[:, None] * axis
    couple = np.cross(moment, axis) / spacing
    larger: Array = np.maximum(np.linalg.norm(across / 2 + couple, axis=1), np.linalg.norm(across / 2 - couple, axis=1))
    return larger


def bending_stress(share: Array, diameter: float, inner: float, eye: float, cheek: float, gap: float) -> Array:
    """σ (n), Pa, in the middle of the eye, whose load is spread over its width."""
    section = math.pi * (diameter**4 - inner**4) / (32 * diameter)
    return np.asarray(share * (cheek / 2 + gap + eye / 4) / section)


def shear_stress(share: Array, diameter: float, inner: float) -> Array:
    """The largest shear stress (n), Pa, of a round section."""
    area = math.pi * (diameter**2 - inner**2) / 4
    return np.asarray(4 / 3 * share / area * (diameter**2 + diameter * inner + inner**2) / (diameter**2 + inner**2))


def edge_pressure(force: Array, moment: Array, diameter: float, width: float) -> Array:
    """Pressure (n), Pa, at the edge of an eye or a bush, under a force (n) and a bending moment (n)."""
    return np.asarray(force / (diameter * width) + 6 * moment / (diameter * width**2))
