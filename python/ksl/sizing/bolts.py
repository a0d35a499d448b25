"""Bolted flanges: loads of each bolt of a circle or pattern, and the bolted joint by VDI 2230."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ksl.mechanism.states import Array
from ksl.sizing.figures import Formula

PATTERN = Formula(
    "F_A,i = F_z/n + a x_i + b y_i about the centroid; F_Q,i = F_xy/n + M_z × r_i / Σ r²", "rigid flange, equal bolts, joint that stays closed; VDI 2230 part 2"
)
BOLT_FORCE = Formula("F_S = α_A F_M + Φ F_A, Φ = n δ_P/(δ_S + δ_P)", "VDI 2230 part 1:2015, R3 and R8")
CLAMP = Formula("F_KR = F_M − F_Z − (1 − Φ) F_A; opens at F_A = (F_M − F_Z)/(1 − Φ)", "VDI 2230 part 1:2015, R3, R5, R6")
SLIP = Formula("F_KQ/F_KR of each bolt, F_KQ = F_Q/(q_F μ_T)", "VDI 2230 part 1:2015, R2")
PRELOAD = Formula("F_Mmin = max(F_KQ + (1 − Φ) F_A) + F_Z", "VDI 2230 part 1:2015, R5")
AMPLITUDE = Formula("F_Sa = Φ (F_A,max − F_A,min)/2", "VDI 2230 part 1:2015, R9")


class BoltLoads(NamedTuple):
    """What each bolt shares of a wrench: axial (…, bolts), along +z, and shear (…, bolts, 2), N."""

    axial: Array
    shear: Array


def circle(bolts: int, radius: float, first_angle: float = 0.0) -> Array:
    """Points (bolts, 2), m, of a bolt circle: bolt i lies at first_angle + 2π i/bolts, rad."""
    angle = first_angle + 2.0 * np.pi * np.arange(bolts) / bolts
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def pattern_loads(points: ArrayLike, force: ArrayLike, moment: ArrayLike) -> BoltLoads:
    """Shares of equal bolts in a wrench on a rigid flange whose joint stays closed.

    points (bolts, 2): in the plane of the flange, m, z along the bolts; force, moment (…, 3): N, and N m about the origin of the
    points, not their centroid.  The shares sum to the wrench.  Axial is along +z: for the force on the flange, a pull along +z.
    Raises ValueError for fewer than three bolts, and for bolts on one line, which carry no moment about it.
    Cost: O(bolts) each.  Source: VDI 2230 part 2; textbooks (F/n + 2 M cos/(n r) on a circle).
    """
    p = np.asarray(points, dtype=float)
    if p.ndim != 2 or p.shape[1] != 2 or len(p) < 3:
        raise ValueError("a flange needs at least three bolts, each with two coordinates")
    F, M = np.asarray(force, dtype=float), np.asarray(moment, dtype=float)
    centroid = p.mean(axis=0)
    x, y = (p - centroid).T
    # moment of F about the centroid, whose z is 0: M − c × F
    Mx, My = M[..., 0] - centroid[1] * F[..., 2], M[..., 1] + centroid[0] * F[..., 2]
    Mz = M[..., 2] - (centroid[0] * F[..., 1] - centroid[1] * F[..., 0])
    Sxx, Syy, Sxy = float(x @ x), float(y @ y), float(x @ y)
    determinant = Sxx * Syy - Sxy * Sxy
    if determinant <= 1e-12 * (Sxx + Syy) ** 2:
        raise ValueError("the bolts lie on one line, so that they carry no moment about it")
    # Σ y f = Mx and −Σ x f = My with f = F/n + a x + b y
    b = (Sxx * Mx + Sxy * My) / determinant
    a = (-Syy * My - Sxy * Mx) / determinant
    axial = F[..., 2, None] / len(p) + a[..., None] * x + b[..., None] * y
    around = (Mz / (Sxx + Syy))[..., None]
    shear = F[..., None, :2] / len(p) + np.stack([-around * y, around * x], axis=-1)
    return BoltLoads(axial, shear)


def load_factor(bolt_resilience: float, plate_resilience: float, introduction: float = 1.0) -> float:
    """Φ = n δ_P/(δ_S + δ_P): the share of an axial load that adds to the bolt.

    bolt_resilience δ_S, plate_resilience δ_P: m/N; introduction n: load introduction factor, at most 1.  VDI 2230 part 1:2015, R3.
    """
    return introduction * plate_resilience / (bolt_resilience + plate_resilience)


def residual_clamp(preload: float, embedding: float, factor: float, axial: ArrayLike) -> Array:
    """Clamp force left in the joint, N: F_M − F_Z − (1 − Φ) F_A; it opens where this is negative.  VDI 2230 part 1:2015, R3, R6."""
    return preload - embedding - (1.0 - factor) * np.asarray(axial, dtype=float)


def clamp_against_slip(shear: ArrayLike, friction: float, interfaces: float = 1.0) -> Array:
    """Clamp force that transverse loads need, N: F_Q/(q_F μ_T).  VDI 2230 part 1:2015, R2."""
    return np.asarray(shear, dtype=float) / (interfaces * friction)


def required_preload(clamp: ArrayLike, factor: float, axial: ArrayLike, embedding: float) -> Array:
    """Smallest assembly preload, N: F_Kerf + (1 − Φ) F_A + F_Z.  VDI 2230 part 1:2015, R5."""
    return np.asarray(clamp, dtype=float) + (1.0 - factor) * np.asarray(axial, dtype=float) + embedding
