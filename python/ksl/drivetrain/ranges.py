"""Ranges of joints: how far one moves, the others kept, to a limit, to the end of reach, or to where the motors hold nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ksl.drivetrain.assembly import positions_of
from ksl.drivetrain.equations import Equations
from ksl.drivetrain.motion import MotionMap
from ksl.drivetrain.swings import Swing
from ksl.mechanism import given
from ksl.mechanism.states import Array

End = Literal["limit", "reach", "hold", "none"]
FINEST, STEP, LONGEST = 1e-3, 0.03, 0.2
"""Steps along the path of all coordinates, rad, and lengths of the mechanism: they follow how the path bends."""
GOLDEN, TOUCHING, TOGETHER, FALLING = 0.6180339887498949, 1e-7, 1e-5, 0.7
TURN = 2 * np.pi
"""Further than a turn, rad, and ten lengths of the mechanism, no end is looked for."""
AT_LIMIT = 1e-9
"""A start that is further beyond a limit is at its end."""
CORRECTIONS, HALVINGS = 10, 45


@dataclass(frozen=True)
class Range:
    """Where a joint ends, rad or m."""

    lower: float
    upper: float
    lower_by: End
    """"limit", of a joint or motor; "reach": a motor at its dead centre, beyond which there is no position; "hold": motors hold nothing there, and
    beyond it they pull the other way; "none": nothing ends it within a turn, and the number is infinite."""
    upper_by: End
    lower_name: str = ""
    """Whose limit; "" where none ends it."""
    upper_name: str = ""


def range_of(a: MotionMap, joint: str, at: ArrayLike | None, limits: bool, own: bool = True) -> Range:
    """As :meth:`ksl.Actuation.range`; own: whether the limits of the joint itself count, where limits do."""
    if joint not in a.joints:
        raise ValueError(f"joint={joint!r}; expected one of {', '.join(a.joints)}")
    if a.model.joint(joint).nv > 1:
        raise ValueError(
            f'joint={joint!r} has several coordinates, so that no one range is its own; ask at which positions motors_of(q, unreachable="nan") has numbers'
        )
    given.flag(limits, "limits")
    return range_of_column(a, a.part.of_joints.index(a.model.joint(joint).v_index), at, limits, own)


def range_of_column(a: MotionMap, k: int, at: ArrayLike | None, limits: bool, own: bool = True) -> Range:
    """The range of one of the numbers of q, as of a joint with one coordinate."""
    equations = a.equations
    Q = a.state(a.start[positions_of(equations, equations.part.of_joints)] if at is None else at)[0]
    if Q.ndim != 1:
        raise ValueError(f"at has {len(Q)} positions; expected one")
    path = _Path(equations, equations.part.of_joints[k], limits, own, Q, a.swings if limits else [])
    (lower, lower_by, lower_name), (upper, upper_by, upper_name) = path.end(-1.0), path.end(1.0)
    return Range(lower, upper, lower_by, upper_by, lower_name, upper_name)


class _Path:
    """The closed positions with all joints kept but one, followed by their length, which goes on where the joint turns back."""

    def __init__(self, equations: Equations, coordinate: int, limits: bool, own: bool, start: Array, swings: Sequence[Swing]) -> None:
        self.equations, self.coordinate, self.start = equations, coordinate, start
        part, m = equations.part, equations.m
        self.kept = [i for i in part.of_joints if i != coordinate]
        self.free = part.without(self.kept)
        self.index = positions_of(equations, [coordinate])[0]
        turns = {joint.v_index + i: joint.has_angle or joint.quaternion == 0 for joint in m.joints if joint.nv for i in range(joint.nv)}
        self.weights = np.array([1.0 if turns[i] else 1.0 / equations.length for i in self.free])
        self.most = TURN if turns[coordinate] else 10 * equations.length
        self.bounds = [bound for bound in self._bounds() if limits and (own or bound[0] != self._own)]
        self.names: list[tuple[End, str]] = [
            ("reach", ""),
            ("hold", ""),
            *(("limit", name) for name, *_ in self.bounds),
            *(("limit", swing.ball) for swing in swings),
        ]
        self.swings = swings
        self.sides = [float(np.sign(x)) for x in self._determinants(start)]

    def end(self, side: float) -> tuple[float, End, str]:
        """Where the path ends, how, and by whose limit."""
        Q, step, tangent = self.start, STEP, self._tangent(self.start)
        tangent = tangent * side * np.sign(tangent[self.free.index(self.coordinate)])
        before = self._events(Q)
        for (by, name), value, (*_, sign, _) in zip(self.names[2:], before[2:], self.bounds):
            if value > AT_LIMIT and (name, sign) != (self._own, -side):
                return float(Q[self.index]), by, name
        if beyond := [swing for swing in self.swings if swing.beyond(self.equations, Q[None])[0] > AT_LIMIT]:
            return float(Q[self.index]), "limit", beyond[0].ball
        while abs(Q[self.index] - self.start[self.index]) < self.most:
            ahead = self._step(Q, tangent, step)
            moved = self._tangent(ahead)
            cosine = float(moved @ tangent)
            if abs(cosine) < 0.99 and step > FINEST:
                step /= 2
                continue
            after = self._events(ahead)
            passed = [(self._root(Q, tangent, step, k), k) for k in range(len(after)) if before[k] <= 0 < after[k]]
            falling = [k for k in (0, 1) if not passed and abs(after[k]) < FALLING * abs(before[k])]
            passed += [(length, k) for k in falling for length in self._touch(Q, tangent, step, k)]
            if passed:
                first = min(length for length, _ in passed)
                k, length = min((k, length) for length, k in passed if length < first + TOGETHER)  # reach before hold, hold before limits
                exact = self.bounds[k - 2][3] if k > 1 and self.names[k][1] == self._own else float(self._step(Q, tangent, length)[self.index])
                return exact, *self.names[k]
            Q, tangent, before = ahead, moved * (np.sign(cosine) or 1.0), after
            step = min(2 * step, LONGEST) if abs(cosine) > 0.9999 else step
        return side * np.inf, "none", ""

    @property
    def _own(self) -> str:
        return next(joint.name for joint in self.equations.m.joints if joint.v_index <= self.coordinate < joint.v_index + joint.nv)

    def _bounds(self) -> list[tuple[str, int, float, float]]:
        """(joint, number in q, sign, bound): sign × (q − bound) is positive beyond it."""
        m, found = self.equations.m, []
        for joint in m.joints:
            if joint.nv and joint.v_index in self.free:
                for c, (least, most) in enumerate(joint.limits):
                    found += [(joint.name, joint.q_index + c, sign, x) for sign, x in ((-1.0, least), (1.0, most)) if x is not None]
        return found

    def _determinants(self, Q: Array) -> tuple[float, float]:
        """With the joints held, and with the motors."""
        G, part = self.equations.jacobian(Q[None])[0], self.equations.part
        reach, *hold = (float(np.linalg.det(G[:, part.without(held)])) for held in (part.of_joints, *combinations(part.of_motors, len(part.of_joints))))
        return reach, hold[0] if len(hold) == 1 else float(np.linalg.norm(hold))  # of more motors than joints: whether none of these hold

    def _events(self, Q: Array) -> list[float]:
        """Numbers that are positive beyond an end."""
        of_motors = [-side * x for side, x in zip(self.sides, self._determinants(Q))]
        swung = [float(swing.beyond(self.equations, Q[None])[0]) for swing in self.swings]
        return of_motors + [sign * (float(Q[i]) - bound) for _, i, sign, bound in self.bounds] + swung

    def _tangent(self, Q: Array) -> Array:
        """The direction of the path, in coordinates times their weights, of length one."""
        G = self.equations.jacobian(Q[None])[0][:, self.free] / self.weights
        direction: Array = np.linalg.svd(G)[2][-1]
        return direction

    def _step(self, Q: Array, tangent: Array, length: float) -> Array:
        """The closed position near one that is so far along the tangent: by corrections of least norm."""
        m, equations = self.equations.m, self.equations
        dV = np.zeros(m.nv)
        dV[self.free] = length * tangent / self.weights
        Q = np.asarray(m.integrate(Q, dV))
        for _ in range(CORRECTIONS):
            errors = equations.errors(Q[None])[0]
            G = equations.jacobian(Q[None])[0][:, self.free] / self.weights
            step = -np.linalg.lstsq(G, errors, rcond=None)[0]
            dV[self.free] = step / self.weights
            Q = np.asarray(m.integrate(Q, dV))
            if np.abs(step).max(initial=0.0) < 1e-14:
                break
        return Q

    def _root(self, Q: Array, tangent: Array, step: float, k: int) -> float:
        """The length within a step at which an event happens, by bisection: it is certain, and there are few."""
        low, high = 0.0, step
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            low, high = (low, middle) if self._events(self._step(Q, tangent, middle))[k] > 0 else (middle, high)
        return (low + high) / 2

    def _touch(self, Q: Array, tangent: Array, step: float, k: int) -> list[float]:
        """The length within two steps at which a determinant is zero and doesn't change its sign: two rods at their dead centres at once.

        It is looked for where the determinant has a minimum there, by golden section.
        """

        def size(length: float) -> float:
            return abs(self._events(self._step(Q, tangent, length))[k])

        low, high = 0.0, 2 * step
        ends = size(low), size(high)
        inner = [(1 - GOLDEN) * high, GOLDEN * high]
        values = [size(x) for x in inner]
        if min(values) >= min(ends):
            return []
        for _ in range(HALVINGS):
            if values[0] < values[1]:
                high, inner, values = inner[1], [0.0, inner[0]], [0.0, values[0]]
                inner[0] = low + (1 - GOLDEN) * (high - low)
                values[0] = size(inner[0])
            else:
                low, inner, values = inner[0], [inner[1], 0.0], [values[1], 0.0]
                inner[1] = low + GOLDEN * (high - low)
                values[1] = size(inner[1])
        return [(low + high) / 2] if min(values) < TOUCHING * min(ends) else []
