"""Mechanisms with loops whose positions somebody chooses by hand: they stay closed."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ksl.mechanism.loops import TOLERANCES
from ksl.mechanism.states import Array

if TYPE_CHECKING:
    from ksl.mechanism.calls import Calls

STARTS = 16
"""So many random positions are tried where no position near the resting one closes."""
STEP = 0.05
"""The largest step of a coordinate from one closed position to the next, rad and m, so that the mechanism stays in the assembly that it is in."""
MOST_STEPS = 200


def closed_near(model: Calls, q: Array) -> Array:
    """A closed position (nq) near to q, within limits if there is one; q itself where none is found."""
    for limits in (True, False):
        found = model.close(q, limits=limits, starts=1)
        if found.converged:
            return np.array(found.q)
    tried = model.close(model.random(0, size=STARTS))
    return np.array(tried.q[np.argmax(tried.converged)]) if tried.converged.any() else q


def open_loops(model: Calls, q: Array) -> NDArray[np.bool_]:
    """(loops): which are open at q (nq)."""
    error, rows = np.abs(model.loop_error(q)), np.cumsum([0, *(loop.equations for loop in model.loops)])
    return np.array([error[start:end].max(initial=0.0) > TOLERANCES["accepted"] for start, end in pairwise(rows)], dtype=bool)


def led_coordinates(model: Calls, q: Array) -> list[int]:
    """Indices into q of the numbers that the others follow from: those of the drives where these determine the motion."""
    independent = {int(i) for i in model.independent(q)}
    return [joint.q_index + k for joint in model.joints for k in range(joint.nv) if joint.v_index + k in independent]


@dataclass(frozen=True)
class Reached:
    """How far a coordinate could be moved."""

    q: Array
    """(nq), closed."""
    reason: str
    """"closed", or why the mechanism could not follow further, as :meth:`Model.close` says it."""


def moved_to(model: Calls, q: Array, index: int, value: float, led: list[int]) -> Reached:
    """The closed position with the number at `index` of q (nq), which is closed, led to a value in steps.

    led: as of :func:`led_coordinates`.  The other ones of these keep their values.
    """
    joints = [joint.name for joint in model.joints if joint.nv == joint.nq and joint.nv and all(joint.q_index + k in led for k in range(joint.nq))]
    start = float(q[index])
    steps = min(max(1, int(np.ceil(abs(value - start) / STEP))), MOST_STEPS)
    for step in range(1, steps + 1):
        wanted = np.array(q)
        wanted[index] = start + (value - start) * step / steps
        found = model.close(wanted, hold=joints, starts=1)
        if not found.converged:
            return Reached(q, str(found.reason))
        q = np.array(found.q)
    return Reached(q, "closed")
