"""Motions that are made from a motion: at rest at each of its samples, and emergency stops from them.

An emergency stop begins at a sample of the motion, at the position q0 with the velocity v0, and ends at rest after the time T:

    v(t) = v0 s(t / T),    a(t) = v0 s'(t / T) / T,    q(t) = q0 ⊕ v0 T S(t / T),    S(x) = integral of s from 0 to x,

so that every joint goes on in its direction at that sample, and all come to rest together.  The law s(x) falls from 1 to 0:
"cubic" 1 − 3x² + 2x³, whose deceleration begins and ends at zero and is largest in the middle, 1.5 v0 / T; or "linear" 1 − x,
whose deceleration is v0 / T throughout.  Both take half of the way v0 T.  What the motion would have gone on to do, and its
acceleration at that sample, are dropped.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ksl.base.errors import MotionError, ResultError
from ksl.base.finite_results import CHECK_UNITS
from ksl.load_cases.joint_limits import limits_of
from ksl.load_cases.case_files.wrenches_over_time import WrenchOverTime, total_on_links
from ksl.mechanism.calls import Calls
from ksl.mechanism.states import Array
from ksl.motions.closed_motion import followed
from ksl.motions.closing import NotClosed
from ksl.motions.motion import Motion

Law = Literal["cubic", "linear"]
SAMPLES = 101
"""How many samples an emergency stop has."""
SEARCHED = 21
"""Samples of each stop while the worst one is searched."""
MOST_STARTS = 2000
"""Without a stated step, so many samples at most are tried as starts, in equal steps of time."""
STATES = 1 << 16
"""Computed at a time."""


@dataclass(frozen=True)
class Stop:
    """An emergency stop: how long, by which law, and from where."""

    duration: float
    """s."""
    law: Law = "cubic"
    start: float | Literal["worst", "all"] = "worst"
    """The time of the motion, s; the worst of all starts; or all of them."""
    step: float | None = None
    """The step between the starts that are tried, s."""

    def profile(self, x: Array) -> tuple[Array, Array, Array]:
        """S, s and s' at x, shares of the duration."""
        if self.law == "linear":
            return x - x**2 / 2, 1 - x, np.full_like(x, -1.0)
        return x - x**3 + x**4 / 2, 1 - 3 * x**2 + 2 * x**3, 6 * x * (x - 1)

    def starts(self, motion: Motion) -> NDArray[np.intp]:
        """Samples that are tried, at least the step apart."""
        time = motion.time
        step = self.step if self.step is not None else (time[-1] - time[0]) / MOST_STARTS if len(time) > MOST_STARTS else 0.0
        if step <= 0:
            return np.arange(len(time))
        with np.errstate(over="ignore"):
            steps = (time - time[0]) / step
        if not np.isfinite(steps).all():  # no two samples are within a step
            return np.arange(len(time))
        # the first sample at or after each multiple of the step; the last one stands for a multiple up to half a step later
        begun = np.floor(steps + 1e-9)
        is_first = np.diff(begun, prepend=-1) > 0
        is_first[-1] |= np.floor(steps[-1] + 0.5) > begun[-1]
        return np.flatnonzero(is_first)

    def motion(self, model: Calls, motion: Motion, start: int, samples: int = SAMPLES) -> Motion:
        """The stop from a sample of a motion."""
        x = np.linspace(0, 1, samples)
        try:
            q, v, a = (y[0] for y in self.states(model, motion, np.array([start]), x))
        except NotClosed as e:
            raise MotionError(f"the stop from {motion.time[start]:.6g} s: {e.why}") from None
        return Motion(motion.time[start] + self.duration * x, q, v, a, closing=motion.closing)

    def states(self, model: Calls, motion: Motion, starts: NDArray[np.intp], x: Array) -> tuple[Array, Array, Array]:
        """q, v and a, each (starts, len(x), …), at shares x of the duration.  Joints that follow by loops do; raises NotClosed where they can't."""
        way, speed, change = (y[:, None] for y in self.profile(x))
        q0, v0 = motion.q[starts][:, None], motion.resolved_v[starts][:, None]
        q = model.integrate(np.broadcast_to(q0, (len(starts), len(x), q0.shape[-1])), v0 * self.duration * way)
        v, a = v0 * speed, v0 * change / self.duration
        return (q, v, a) if motion.closing is None else followed(model, motion.closing, motion.q[starts], (q, v, a))


def at_rest(motion: Motion) -> Motion:
    """The positions of a motion, each held at rest."""
    still = np.zeros_like(motion.v)
    return Motion(motion.time, motion.q, still, still, closing=motion.closing)


def nearest_sample(motion: Motion, time: float) -> int:
    return int(np.argmin(np.abs(motion.time - time)))


def worst_start(model: Calls, motion: Motion, stop: Stop, external: Sequence[WrenchOverTime]) -> int:
    """The sample whose stop uses the largest share of an effort limit; if none is given, of the largest effort of the joint in all stops.

    External wrenches are those of the start, held.  Raises MotionError for a stop that has no efforts.
    """
    starts, x = stop.starts(motion), np.linspace(0, 1, SEARCHED)
    largest = np.concatenate([_largest_efforts(model, motion, stop, part, x, external) for part in _parts(starts, len(x))])
    limits = np.array([limits_of(j).effort or 0.0 for j in model.joints if j.nv == 1 and j.v_index >= 0])
    columns = [j.v_index for j in model.joints if j.nv == 1 and j.v_index >= 0]
    if not columns:
        return int(starts[np.argmax(np.abs(largest).max(axis=1, initial=0.0))])
    efforts = largest[:, columns]
    given = limits > 0
    scale = np.where(given, limits, np.inf) if given.any() else np.maximum(efforts.max(axis=0), 1e-300)
    return int(starts[np.argmax((efforts / scale).max(axis=1))])


def _parts(starts: NDArray[np.intp], samples: int) -> list[NDArray[np.intp]]:
    size = max(1, STATES // samples)
    return [starts[i : i + size] for i in range(0, len(starts), size)]


def _largest_efforts(model: Calls, motion: Motion, stop: Stop, starts: NDArray[np.intp], x: Array, external: Sequence[WrenchOverTime]) -> Array:
    """(starts, nv): the largest magnitude of each effort during the stop from each start."""
    time = np.repeat(motion.time[starts], len(x))
    try:
        q, v, a = stop.states(model, motion, starts, x)
        flat = total_on_links(external, model, time, q.reshape(len(time), -1))
        held = {link: w.reshape(len(starts), len(x), 6) for link, w in flat.items()}
        largest: Array = np.abs(model.inverse_dynamics(q, v, a, held or None)).max(axis=1)
    except NotClosed as e:
        raise MotionError(f"the stop from {motion.time[starts[e.row]]:.6g} s: {e.why}") from None
    except ResultError as e:
        about = "" if model.loops else f"; {CHECK_UNITS}"
        raise MotionError(f"the stop from {time[e.state]:.6g} s: {e}{about}") from None
    return largest
