"""The size of efforts beside that of the prior's bodies: factors of units, of gears and of torque constants, and efforts that are nothing but noise.

A factor common to all efforts makes bodies whose masses are as wrong, and which explain the efforts as well as the right ones do.  No residual shows it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ksl.base.words import listed
from ksl.identify.chance import SURE, rare
from ksl.identify.consistency import Array
from ksl.identify.fit import Fit

FAR = 3.0
"""Efforts more than so many times as large as the prior's bodies need, or as small, are doubtful whatever the prior's deviation is."""

ALIKE = 0.9
"""The least cosine of the angle between efforts and those of the prior at which one is a multiple of the other, but for noise and details of the bodies."""

VISIBLE = 0.05
"""Joints that need less than this share of the largest effort of their unit say nothing of a factor: details of the bodies decide there."""

COMMON, SMALL_FACTOR, JOINTS = 0.01, 1.25, 3
"""A factor that is larger than SMALL_FACTOR, or smaller than its reciprocal, is doubtful if with it this share of the squared difference is left, beyond
noise, at so many joints: bodies that are wrong each by itself don't look like that."""

GEAR = 0.1
"""A factor is that of a gear if it is so near to it, as a share."""


@dataclass(frozen=True)
class EffortScale:
    """Efforts over those that the bodies of the prior need, with all that the model adds to both: other links, physics, external wrenches."""

    factors: Array
    """(nv): least squares of each joint; NaN where the prior needs hardly any effort."""
    agreement: Array
    """(nv): cosine of the angle between the efforts and those of the prior, over all samples: 1 where one is a multiple of the other."""
    common: float
    """The mean factor of the joints whose efforts agree; NaN without such a joint."""
    left: float
    """Share of the squared difference that the common factor leaves, beyond noise."""


def effort_scale(fit: Fit, slides: Array) -> EffortScale:
    """slides (nv): which numbers are forces."""
    own, both, given = fit.beside_prior
    with np.errstate(invalid="ignore", divide="ignore"):
        factors, agreement = both / own, np.nan_to_num(both / np.sqrt(own * given))
        largest = np.array([own[slides == s].max() for s in slides])
        factors[~(own > VISIBLE**2 * largest)] = np.nan
        used = np.isfinite(factors) & (agreement >= ALIKE)
        if not used.any():
            return EffortScale(factors, agreement, np.nan, 1.0)
        common = float(np.mean(factors[used]))
        noise = fit.n * np.nan_to_num(fit.noise_of_joints()[0][used]) ** 2
        before, after = ((given[used] - 2 * s * both[used] + s * s * own[used] - noise) / own[used] for s in (1.0, common))
        return EffortScale(factors, agreement, common, float(max(after.sum(), 0.0) / max(before.sum(), 1e-300)))


def doubts_about_scale(scale: EffortScale, fit: Fit, joints: list[str], gears: Array) -> list[str]:
    """Sentences on factors and noise.  joints, gears: names and gear ratios (nv) of the numbers of efforts."""
    own, _, given = fit.beside_prior
    absent = [name for name, needed, there in zip(joints, own, given, strict=True) if there == 0 and needed > 1e-20 * own.max()]
    if absent:
        return [
            f"efforts of {listed(absent)} are zero in every sample, and the prior's bodies need some: give what was measured there; zeros are taken as measured"
        ]
    visible = np.isfinite(scale.factors)
    of_noise = _look_like_noise(scale, fit, visible)
    if of_noise.any():
        which = "all efforts look" if (of_noise | ~visible).all() else f"efforts of {listed([joints[k] for k in np.flatnonzero(of_noise)])} look"
        most = float(np.abs(scale.agreement[of_noise]).max())
        return [
            f"{which} like noise, or like those of another motion: what the prior's bodies need for this one agrees with them no better than by chance (a cosine of "
            f"{most:.2g}, 1 is right); check that they are of these joints, and at the times of the positions"
        ]
    with np.errstate(invalid="ignore", divide="ignore"):
        size = np.abs(np.log(np.abs(scale.factors)))
    alike = visible & (np.abs(scale.agreement) >= ALIKE)
    far = alike & ((size > np.log(FAR)) | (scale.factors < 0))
    one = (alike & (scale.factors > 0)).sum() >= JOINTS and scale.left < COMMON and abs(np.log(scale.common)) > np.log(SMALL_FACTOR)
    if not (far.any() or one):
        return []
    chosen = alike if one or (far == alike).all() else far
    named = [f"{joints[k]} {scale.factors[k]:.3g}{_of_gear(float(scale.factors[k]), float(gears[k]))}" for k in np.flatnonzero(chosen)]
    common = (
        f"{scale.common:.4g} times those that the prior's bodies need, with one factor for all joints"
        if one
        else "other multiples of what the prior's bodies need"
    )
    return [
        f"efforts are {common}: {listed(named)}.  Are they of motors, before the gears, in per mille or in another unit than N m and N, or with another "
        "sign?  Bodies that explain them are wrong by the same factors; convert the efforts, or correct the prior"
    ]


def _look_like_noise(scale: EffortScale, fit: Fit, visible: Array) -> Array:
    """Which visible joints (nv) have efforts that agree with the prior's, and depend on the motion, no more than noise does."""
    squares = fit.n * scale.agreement**2
    together = int(visible.sum())
    if together and float(squares[visible].sum()) < rare(together) < fit.n * together / 4:
        return visible
    alone, freedom = fit.noise_of_joints()
    with np.errstate(invalid="ignore", divide="ignore"):
        explained = 1 - alone**2 * fit.n / fit.beside_prior[2]
        by_chance = explained < SURE * np.sqrt(2 / freedom)
    return np.asarray(visible & by_chance & (squares < SURE**2) & (fit.n > 4 * SURE**2))


def _of_gear(factor: float, gear: float) -> str:
    for multiple, words in ((1 / gear, f" (1/{gear:g} is its gear ratio)"), (gear, f" ({gear:g} is its gear ratio)")):
        if gear not in (0.0, 1.0) and abs(factor / multiple - 1) < GEAR:
            return words
    return ""
