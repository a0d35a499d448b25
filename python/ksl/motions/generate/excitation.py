"""Motions that excite inertial parameters: periodic, and with a regressor of small condition number.

Swevers, Ganseman, Tükel, De Schutter, Van Brussel, Optimal robot excitation and identification, T-RA 13 (1997): positions are finite Fourier series.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ksl.base.errors import MotionError
from ksl.identify.base_parameters import BaseParameters, structural
from ksl.model.model import Model
from ksl.mechanism.states import Array
from ksl.motions.generate.generated import SHARE, Generated, Limits, effort_stretch, limits_of, sample_times, whole_motion

HARMONICS = 5
SAMPLES = 100
"""Samples of a period, at which the regressor is evaluated during the search."""

USED = 0.9
"""Share of the range of positions that is used."""

BELOW = 0.985
"""How far below limits peaks at the samples of the search must be, for those between them."""

SINGULAR = 1e7
"""The condition number of a motion that doesn't excite all parameters."""

STILL = 0.01
"""Share by which the condition number may fall in the last quarter of a search that is at its end."""

START = 40
"""Random motions, of which the best one is then improved."""


@dataclass(frozen=True)
class Series:
    """Fourier series of m joints with a fundamental frequency 1/period, whose velocities and accelerations are zero at t = 0.

    q = c + Σ (A_l sin l ω t − B_l cos l ω t) / (l ω), v = Σ A_l cos + B_l sin, l = 1 … N.
    """

    limits: Limits
    period: float

    @property
    def size(self) -> int:
        """Numbers of a candidate: A, B, a share of the limits and a place of the middle for each joint."""
        return len(self.limits.joints) * (2 * HARMONICS + 2)

    @property
    def times(self) -> Array:
        """The times of the search: 20 in the shortest period, so that peaks between them are at most 1.3 % higher."""
        return np.arange(SAMPLES) * (self.period / SAMPLES)

    def __call__(self, x: Array, t: Array) -> tuple[Array, Array, Array]:
        """q, v and a (n, m) of the candidate x at times t (n); any x gives a motion within the limits of position, speed and acceleration."""
        m = len(self.limits.joints)
        numbers = x.reshape(m, 2 * HARMONICS + 2)
        A, B = numbers[:, :HARMONICS], numbers[:, HARMONICS : 2 * HARMONICS]
        w = 2 * np.pi / self.period * np.arange(1, HARMONICS + 1)
        A = A - A.mean(axis=1, keepdims=True)  # v(0) = Σ A = 0
        B = B - np.outer(B @ w, w) / (w @ w)  # a(0) = Σ B l ω = 0
        q, v, a = _series(A, B, w, self.times)
        low, high = q.min(axis=0), q.max(axis=0)
        at_limits = (2 * USED * self.limits.half, BELOW * SHARE * self.limits.velocity, BELOW * self.limits.acceleration)
        used = np.maximum.reduce([x / limit for x, limit in zip((high - low, np.abs(v).max(axis=0), np.abs(a).max(axis=0)), at_limits, strict=True)])
        share = 1 / (1 + np.exp(-3 - numbers[:, -2]))  # between 0 and 1
        scale = share / np.maximum(used, 1e-300)
        room = USED * self.limits.half - scale * (high - low) / 2  # of `used` the range is one
        middle = self.limits.middle + room * np.tanh(numbers[:, -1]) - scale * (high + low) / 2
        q, v, a = _series(A, B, w, t)
        return middle + scale * q, scale * v, scale * a


def _series(A: Array, B: Array, w: Array, t: Array) -> tuple[Array, Array, Array]:
    s, c = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
    return (s / w) @ A.T - (c / w) @ B.T, c @ A.T + s @ B.T, (-s * w) @ A.T + (c * w) @ B.T


def excitation(
    model: Model,
    period: float = 10.0,
    rate: float = 250.0,
    seconds: float = 20.0,
    iterations: int | None = None,
    seed: int = 0,
    acceleration: float | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> Generated:
    """A periodic motion, starting at rest, that identifies inertial parameters well: the best one found in `seconds` of search.

    The condition number of the regressor of the base parameters (σ_max / σ_min of all rows of a period, SI units) is made small by a random
    search, (1 + 1) with steps that adapt: 5 harmonics, within limits of position, speed, effort and `acceleration` if that is given.
    iterations: so many candidates instead of a time; with the same seed the motion is then the same.
    progress: called with the share that is done, and the smallest condition number so far.
    facts: condition (at the samples of the search), first (the best of 40 random ones), parameters, iterations; gain, the share by which the condition
    number fell in the last quarter of the candidates, converged, whether that is below 1 %, and reason, "improving" or "singular" if not.
    Raises MotionError.
    """
    limits = limits_of(model, acceleration)
    if iterations is not None and iterations < 1:
        raise MotionError(f"{iterations} iterations; expected at least one")
    if iterations is None and not 0 < seconds < np.inf:
        raise MotionError(f"{seconds:g} seconds of search; expected a positive number")
    if seed < 0:
        raise MotionError(f"seed {seed}; expected 0 or more")
    t_fine = sample_times(period, rate)
    base = structural(model)
    if not len(base):
        raise MotionError(f"{model.name}: efforts depend on no inertial parameter, so that no motion excites any")
    series = Series(limits, period)
    search = _Search(model, limits, base, series, seed)
    begin = clock.monotonic()

    def done() -> float:
        return search.tried / iterations if iterations is not None else (clock.monotonic() - begin) / seconds

    while not search.tried or done() < 1:
        search.step()
        if progress is not None and search.tried % 10 == 0:
            progress(min(1.0, done()), search.smallest)
    if not np.isfinite(search.smallest):
        raise MotionError(f"{model.name}: none of {search.tried} candidates can be followed by the joints that loops move; narrow the limits of the drives")
    motion = whole_motion(model, limits, t_fine, *series(search.best, t_fine))
    stretch, heavy = effort_stretch(model, limits, motion, SHARE)
    if stretch > 1:  # between the samples of the search, or where all candidates were beyond a limit
        t_fine, motion = t_fine * stretch, whole_motion(model, limits, t_fine * stretch, *_slower(series(search.best, t_fine), stretch))
    facts: dict[str, object] = {
        "kind": "excite", "period": period * stretch, "rate": rate / stretch, "seed": seed, "iterations": search.tried,
        "condition": search.smallest, "first": search.first, "parameters": len(base), **search.progress(),
    }  # fmt: skip
    return Generated(motion, [*limits.said(), *heavy, *_unfinished(facts)], facts)


def _unfinished(facts: Mapping[str, object]) -> list[str]:
    """A search ends by its time or number of candidates: whether it was still finding better ones."""
    if facts["converged"]:
        return []
    if facts["reason"] == "singular":
        return [f"no motion was found that excites all {facts['parameters']} combinations of parameters; search longer, or give the joints more range or speed"]
    return [
        f"the search was not at its end: in its last quarter the condition number still fell by {100 * float(str(facts['gain'])):.2g} %; "
        "more time (--seconds) or candidates (--iterations) give a better motion"
    ]


class _Search:
    """A random search, (1 + 1) with steps that adapt, for the series with the smallest condition number."""

    def __init__(self, model: Model, limits: Limits, base: BaseParameters, series: Series, seed: int) -> None:
        self._model, self._limits, self._base, self._series = model, limits, base, series
        self._rng, self._length = np.random.default_rng(seed), 0.5
        self.best = self._rng.normal(size=series.size)
        self.smallest = self.first = np.inf
        """The cost of the best candidate, and that of the best of the first, random ones."""
        self.tried = 0
        self._after: list[float] = []
        """The smallest cost after each candidate."""

    def progress(self) -> dict[str, object]:
        """How far the search came: gain, converged and reason."""
        before = self._after[(3 * self.tried) // 4 - 1] if self.tried > 3 else np.inf
        gain = float(1 - self.smallest / before) if np.isfinite(before) else 1.0
        reason = "singular" if self.smallest >= SINGULAR else "converged" if gain < STILL and self.tried > START else "improving"
        return {"gain": gain, "converged": reason == "converged", "reason": reason}

    def step(self) -> None:
        """Tries one candidate."""
        rng, size, starts = self._rng, self._series.size, self.tried < START
        # a few numbers at a time: there are too many to change all of them by much
        chosen = rng.random(size) < max(0.1, 4 / size)
        x = rng.normal(size=size) if starts else self.best + self._length * chosen * rng.normal(size=size)
        found = self._cost(x)
        if found < self.smallest:
            self.best, self.smallest = x, found
        if starts:
            self.first = self.smallest
        else:  # the rule of one success in five
            self._length = float(np.clip(self._length * (1.3 if x is self.best else 0.94), 0.02, 1.5))
        self.tried += 1
        self._after.append(self.smallest)

    def _cost(self, x: Array) -> float:
        """The condition number, and more where efforts are beyond their limits; infinite where loops can't follow."""
        model, limits, base, t = self._model, self._limits, self._base, self._series.times
        try:
            motion = whole_motion(model, limits, t, *self._series(x, t))
        except MotionError:
            if model.loops:
                return float("inf")
            raise
        W = base.regressor(model.inverse_dynamics_regressor(motion.q, motion.v, motion.a, links=base.links)).reshape(-1, len(base))
        roots = np.linalg.eigvalsh(W.T @ W)
        tau = np.abs(model.inverse_dynamics(motion.q, motion.v, motion.a)[:, limits.v_index]).max(axis=0) / (SHARE * limits.effort)
        condition = min(SINGULAR, np.sqrt(roots[-1] / roots[0])) if roots[0] > 0 else SINGULAR
        return float(condition * (1 + 10 * max(0.0, float(tau.max()) - 1)))


def _slower(states: tuple[Array, Array, Array], stretch: float) -> tuple[Array, Array, Array]:
    q, v, a = states
    return q, v / stretch, a / stretch**2
