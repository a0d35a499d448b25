"""How far an identification got, and whether prior, bodies and noise agree with the motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from ksl.identify.base_parameters import BaseParameters, triangle
from ksl.identify.chance import SURE, rare
from ksl.identify.consistency import Array
from ksl.identify.effort_scale import EffortScale, doubts_about_scale, effort_scale
from ksl.identify.fit import FREEDOM, SETTLED, Fit
from ksl.identify.possible_bodies import Minimum

Reason = Literal["converged", "rounding", "noise"]


@dataclass(frozen=True)
class Certificate:
    """What is known of the result without trusting the method that found it."""

    converged: bool
    """Is the sum of squares at its minimum, and the noise settled?"""
    reason: Reason
    """"converged", or why not: "rounding" kept the steps from the minimum; the "noise" that is estimated from the residuals didn't settle."""
    sum_of_squares: float
    """The sum of the squares of residuals over noise, and of the distance from the prior over its deviation."""
    above_minimum: float
    """The sum of squares is at most this much above the least one that possible bodies have: a bound by the dual problem."""
    gradient: float
    """Length of the gradient of the Lagrangian, in the metric of the covariance: how many standard deviations parameters are off by it."""
    steps: int
    """Steps of the interior point method, in the last round; 0 if least squares gave possible bodies."""
    rounds: int
    """How often noise was estimated; 1 if it was given."""
    noise_change: float
    """Share by which the estimate of the noise last changed."""
    misfit: Array
    """(nv): root mean square of the residuals over the noise that was given, or else over what least squares of that joint by itself leaves.
    1 where the parameters explain the efforts to the noise; NaN where there are too few samples to tell."""
    prior_distance: float
    """Root mean square distance, over the combinations that the motion identifies, of what the motion by itself says from what the prior says, in
    standard deviations of the difference.  1 for a prior as good as its deviation; 0 without such combinations."""
    prior_differences: Array
    """(n of base): that difference of each combination, in its own standard deviation."""
    pull: Array
    """(n of base): base values less what the motion by itself says of them, in standard deviations of the base values.  It is large where the prior
    knows more than the motion, and where prior or constraint are wrong: then `doubts` say so."""
    excess: float
    """By how much the squares of the residuals sum to more than with bodies that can't exist."""
    scale: EffortScale
    """The factors between the efforts and those that the bodies of the prior need."""
    doubts: tuple[str, ...]
    """Sentences on what is doubtful, if anything."""

    def __str__(self) -> str:
        turns = f"{self.steps} steps" + (f", {self.rounds} estimates of the noise" if self.rounds > 1 else "")
        first = f"{'converged' if self.converged else 'not converged'} ({turns}): the sum of squares, {self.sum_of_squares:.6g}, is within "
        agree = f"prior and motion differ by {self.prior_distance:.3g} standard deviations (1 is usual)"
        return "\n".join([f"{first}{max(self.above_minimum, 0.0):.2g} of its minimum, the gradient is {self.gradient:.2g}; {agree}", *self.doubts])


class EffortFacts(NamedTuple):
    """What the nv numbers of tau are."""

    names: list[str]
    are_forces: Array
    """Which are forces, N; the others are moments, N m."""
    gears: Array


def certificate(
    fit: Fit, parameters: Array, found: Minimum, base: BaseParameters, efforts: EffortFacts, noise_given: bool, rounds: int, change: float
) -> Certificate:
    """The certificate of what `fit` found last."""
    root = fit.root_of_covariance()
    misfit, freedom = _misfit(fit, parameters, root, noise_given)
    said, distance = _prior_and_motion(fit, base)
    differences = (said.motion - said.prior) / np.hypot(said.of_motion, said.of_prior)
    pull = (base.values(parameters) - said.motion) / np.linalg.norm(base.matrix @ root, axis=1)
    excess = fit.excess(found)
    settled = noise_given or change <= SETTLED
    reason: Reason = "rounding" if not found.converged else "converged" if settled else "noise"
    scale = effort_scale(fit, efforts.are_forces)
    doubts = doubts_about_scale(scale, fit, efforts.names, efforts.gears)
    if reason == "rounding":
        doubts.append(
            f"not converged: rounding stopped the search where the sum of squares may be {found.above:.2g} above its minimum; "
            "a larger `noise`, or a prior nearer to the robot, makes the problem better conditioned"
        )
    if reason == "noise":
        doubts.append(f"not converged: the estimate of the noise still changed by {change:.2g} of itself after {rounds} rounds; give `noise`")
    if len(base) * distance**2 > rare(len(base)):
        doubts.append(_of_the_prior(base, differences, distance, said, pull))
    if excess > rare(len(base)):
        doubts.append(
            f"no possible bodies explain the efforts: squares of residuals over noise sum to {excess:.3g} more than with parameters that no body has; look for "
            "efforts with the wrong sign, offsets, friction or rotors, or for known links whose parameters are wrong.  base_deviations leave that out"
        )
    doubts += _of_the_noise(misfit, freedom, efforts.names, noise_given)
    return Certificate(
        reason == "converged", reason, found.sum_of_squares, found.above, found.gradient, found.steps, rounds, change,
        misfit, distance, differences, pull, excess, scale, tuple(doubts),
    )  # fmt: skip


def _misfit(fit: Fit, parameters: Array, root: Array, noise_given: bool) -> tuple[Array, Array]:
    """The misfit of each joint, and the degrees of freedom on which it rests."""
    freedom = fit.freedom(root)
    known, alone = (fit.sigma, np.full(fit.nv, np.inf)) if noise_given else fit.noise_of_joints()
    enough = (freedom > FREEDOM * fit.n) & ~np.isnan(known)
    with np.errstate(invalid="ignore", divide="ignore"):
        left = np.sqrt(np.sum(fit.residuals(parameters) ** 2, axis=0) / np.where(enough, freedom, np.nan))
    return np.asarray(np.maximum(left, 0 if noise_given else fit.least_noise()) / known), np.minimum(freedom, alone)


@dataclass(frozen=True)
class _Said:
    """Values of the combinations, and their standard deviations, by the prior and by the motion alone."""

    prior: Array
    of_prior: Array
    motion: Array
    of_motion: Array


def _prior_and_motion(fit: Fit, base: BaseParameters) -> tuple[_Said, float]:
    """What each says, and the root mean square difference by both covariances together."""
    n = len(base)
    if not n:
        return _Said(*[np.zeros(0)] * 4), 0.0
    Q, R = np.linalg.qr(fit.weighted[:, base.columns])
    scale = np.linalg.norm(R, axis=0)
    motion_root = np.linalg.inv(R / scale) / scale[:, None]  # times its transpose: the covariance
    motion = motion_root @ (Q.T @ fit.weighted[:, -1])
    prior, prior_root = base.values(fit.prior), base.matrix @ fit.from_steps
    both = triangle(np.hstack([motion_root, prior_root]).T).T  # lower triangular
    length = np.linalg.norm(both, axis=1)
    apart = np.linalg.solve(both / length[:, None], (motion - prior) / length)
    return _Said(prior, np.linalg.norm(prior_root, axis=1), motion, np.linalg.norm(motion_root, axis=1)), float(np.sqrt(np.mean(apart**2)))


def _of_the_prior(base: BaseParameters, differences: Array, distance: float, said: _Said, pull: Array) -> str:
    k = int(np.argmax(np.abs(differences)))
    pulled = int(np.argmax(np.where(np.abs(differences) > 3, np.abs(pull), 0)))
    effect = (
        f"it pulls {_short(base.names[pulled])} by {abs(pull[pulled]):.3g} of the standard deviation that base_deviations give, which hold only if both are right"
        if abs(pull[pulled]) > 0.5
        else "the motion decides the combinations, and the prior only what the motion doesn't identify"
    )
    return (
        f"prior and motion disagree: by {distance:.3g} standard deviations over {len(base)} combinations, where 1 is usual; most in {_short(base.names[k])}: "
        f"{said.prior[k]:.4g} ± {said.of_prior[k]:.2g} by the prior, {said.motion[k]:.4g} ± {said.of_motion[k]:.2g} by the motion; {effect}.  "
        "Correct the prior, or give a larger prior_deviation"
    )


def _short(name: str) -> str:
    return name if len(name) <= 60 else name[:57] + "…"


def _of_the_noise(misfit: Array, freedom: Array, joints: list[str], given: bool) -> list[str]:
    """Where residuals are not the noise that they should be: variances differ by more than chance, and by a tenth."""
    with np.errstate(invalid="ignore", divide="ignore"):
        chance = SURE * np.sqrt(2.0 / freedom) * (1.0 if given else np.sqrt(2.0))
        large, small = misfit**2 > 1.1 + chance + chance**2, (misfit**2 < 0.9 - chance) & given
    out = []
    if large.any():
        k = int(np.nanargmax(np.where(large, misfit, np.nan)))
        known = "the noise that was given" if given else "what least squares of that joint by itself leaves"
        out.append(
            f"residuals are not noise: those of {joints[k]} are {misfit[k]:.3g} times {known}"
            f"{f', and {large.sum() - 1} more' if large.sum() > 1 else ''}; the parameters don't explain all joints, and base_deviations are too small"
        )
    if small.any():
        k = int(np.nanargmin(np.where(small, misfit, np.nan)))
        out.append(f"residuals of {joints[k]} are only {misfit[k]:.3g} times the noise that was given; base_deviations are too large")
    return out
