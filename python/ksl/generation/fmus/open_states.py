"""A closed mechanism between the steps of a method: its accelerations where loops are not quite closed, and the equations that close them again.

Both are parts of the recorded forward dynamics, which is NaN where an error of an equation, or its rate, is above a limit: |error| <= limit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ksl import _core
from ksl.base.errors import ArgumentError
from ksl.generation.recording import Operation, Recording
from ksl.generation.requests import Function

if TYPE_CHECKING:
    from ksl.model.model import Model

CLOSING = Path(__file__).parent / "fmi3/closing.h"
"""What moves a state to the nearest closed one."""
TOLERANCES = _core.loop_tolerances()
ANYWHERE = 1e30
"""A limit that no state reaches."""
FURTHEST = 1e-2
"""No file has so few digits that states which are open by more are accepted, in lengths."""
RANK_BY_DIGITS, CLOSED_BY_DIGITS = 10, 3
"""How far open states, and closed ones, may be, in digits of the file (include/ksl/engine/algorithms/loops/tolerances.hpp)."""
MOVED = 1e-6
"""The way along which errors are compared with their rates, as a share of a second."""


@dataclass(frozen=True)
class OpenStates:
    """What goes on from a state to the next.  Errors are lengths, those of angles times the length of the mechanism."""

    dynamics: Function
    """forward_dynamics, however far loops are open."""
    equations: Function
    """opening(q, v, error, rate): error and rate (rows); rate is linear in v."""
    rows: int
    length: float
    """A length of the mechanism, m."""
    accepted: float
    """How far a state may be open, in lengths."""

    @property
    def closed_within(self) -> float:
        """How far open what is closed may be, in lengths: rounding, and the digits of the file."""
        return TOLERANCES["closed"] + CLOSED_BY_DIGITS * (self.accepted - TOLERANCES["accepted"]) / RANK_BY_DIGITS


def open_states(model: Model, of: Function) -> OpenStates:
    """of: the recorded forward dynamics.  Raises ArgumentError where the loops' equations are not all in it."""
    start, recording = model.close(model.neutral()), of.recording
    if not start.converged:
        raise ArgumentError(f"{model.name}: no closed position was found near the neutral one: {start.reason}; call m.simulate")
    length = model.mobility(start.q).length
    errors, rates, limit = _equations(recording, length)
    signs = _signs(model, _opening(recording, [*errors], [*rates], [1] * len(errors)), start.q)
    opening = _opening(recording, [*errors], [*rates], signs)
    return OpenStates(
        replace(
            of,
            recording=_anywhere(recording, [*errors.values(), *rates.values()]),
            text="Accelerations a (nv) between steps, however far loops are open, by the pivots of the mechanism's plan: NaN where these are too small.",
        ),
        replace(
            of,
            name="opening",
            recording=opening,
            text="Errors of the loops' equations, as lengths, m, and their rates, which are linear in v: zero for what keeps loops closed.",
        ),
        len(errors),
        length,
        limit / length,
    )


def _equations(of: Recording, length: float) -> tuple[dict[int, int], dict[int, int], float]:
    """{the step of an error: that which compares it}, the same of rates, and the limit of errors, m.  A rate's limit is A + B with the constant A: that of rest."""
    rest = TOLERANCES["closed"] * length
    constants = {step: float(of.numbers[step]) for step in np.flatnonzero(of.operations == Operation.CONSTANT).tolist()}
    rates: dict[int, int] = {}
    others: dict[int, tuple[int, float]] = {}
    for step in np.flatnonzero(of.operations == Operation.AT_MOST).tolist():
        size, limit, _ = of.operands[step].tolist()
        if of.operations[size] != Operation.ABSOLUTE:
            continue
        compared = int(of.operands[size, 0])
        if limit in constants:
            others[compared] = step, constants[limit]
        elif of.operations[limit] == Operation.ADD and any(np.isclose(constants.get(x, 0.0), rest, rtol=1e-9, atol=0) for x in of.operands[limit].tolist()):
            rates[compared] = step
    # of what is compared with constants, errors have the limit nearest to that of the library
    limits = {limit for _, limit in others.values() if TOLERANCES["accepted"] * length * (1 - 1e-9) <= limit <= FURTHEST * length}
    if len(limits) != 1:
        raise ArgumentError("the equations of the loops are not found in what was recorded of this mechanism; call m.simulate")
    (limit,) = limits
    return {compared: step for compared, (step, of_it) in others.items() if of_it == limit}, rates, limit


def _opening(of: Recording, errors: list[int], rates: list[int], signs: list[int]) -> Recording:
    """Errors, times 1 or −1 each, and rates, as results of their own."""
    negated = {step: len(of.operations) + k for k, (step, sign) in enumerate(zip(errors, signs)) if sign < 0}  # of as many steps behind all others
    return replace(
        of,
        inputs=of.inputs[:2],
        results=(("error", (len(errors),)), ("rate", (len(rates),))),
        operations=np.concatenate([of.operations, np.full(len(errors), Operation.NEGATE, np.uint8)]),
        operands=np.concatenate([of.operands, np.array([[step, -1, -1] for step in errors], np.int32)]),
        numbers=np.concatenate([of.numbers, np.zeros(len(errors))]),
        outputs=np.array([negated.get(step, step) for step in errors] + rates, np.int32),
    ).needed()


def _signs(model: Model, opening: Recording, q: NDArray[np.floating[Any]]) -> list[int]:
    """±1 for each error, so that its rate is that of the equation.  Errors and rates are compared along random velocities, and counted beside the library's equations."""
    rng = np.random.default_rng(0)
    v = rng.normal(size=model.nv)
    ahead, behind = (opening.play([model.integrate(q, sign * MOVED * v), v])[0] for sign in (1, -1))
    error, rate = (ahead - behind) / (2 * MOVED), opening.play([q, v])[1]
    columns = np.array([opening.play([q, unit])[1] for unit in np.eye(model.nv)]).T
    freedoms = model.mobility(q)
    complete = len(error) == len(rate) and np.linalg.matrix_rank(columns, tol=1e-7 * np.abs(columns).max()) == freedoms.rank
    if not complete or not np.allclose(np.abs(error), np.abs(rate), rtol=1e-5, atol=1e-6 * np.abs(rate).max()):
        raise ArgumentError(f"{model.name} has equations of loops that are not found in what was recorded of it; cut the loops, or call m.simulate")
    return [-1 if x * y < 0 else 1 for x, y in zip(error, rate)]


def _anywhere(of: Recording, comparisons: list[int]) -> Recording:
    """A recording with a limit that no state reaches in these comparisons: a constant before all other steps."""
    operands = np.where(of.operands >= 0, of.operands + 1, -1).astype(np.int32)
    operands[comparisons, 1] = 0
    return replace(
        of,
        operations=np.concatenate([np.array([Operation.CONSTANT], np.uint8), of.operations]),
        operands=np.concatenate([np.full((1, 3), -1, np.int32), operands]),
        numbers=np.concatenate([[ANYWHERE], of.numbers]),
        outputs=np.where(of.outputs >= 0, of.outputs + 1, -1).astype(np.int32),
    ).needed()
