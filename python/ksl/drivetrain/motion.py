"""Positions and rates of motors and joints of one mechanism, through the rods between them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.words import listed
from ksl.drivetrain.assembly import follow, positions_of
from ksl.drivetrain.equations import Equations
from ksl.drivetrain.parts import part_of
from ksl.drivetrain.sharing import Sharing, held_motors, inverse_of, inverse_rate, scales_of
from ksl.drivetrain.swings import swings_of
from ksl.mechanism import given
from ksl.mechanism.requests import one_of
from ksl.mechanism.states import Array, finite_rows, leading_shape

if TYPE_CHECKING:
    from ksl.model.model import Model

Carrier = tuple[ArrayLike, ArrayLike, ArrayLike]
"""Position, velocity and acceleration of the whole model, of which those of joints that the mechanism doesn't move count."""
Unreachable = Literal["raise", "nan"]
TOGETHER = 1e-6
"""How far motors that are more than the joints may be from where the others put them, rad or m."""
WEAK, WORST = 1e-10, 1e8
"""Rates of motors, relative to those at the start, below which they hold nothing; the condition of equations above which a start is a dead centre."""


EXACT = 1e-12
"""Errors of positions, rad or m, below which results of compiled code are taken."""
COMPILED = ("motors_of", "joints_of", "jacobian", "motor_jacobian", "motor_velocities", "joint_velocities", "static_motor_efforts", "static_joint_efforts")
"""Calls that :meth:`ksl.Actuation.compile` has."""


class StateError(ValueError):
    """Something can't be computed in one state of several."""

    def __init__(self, what: str, state: int, states: int, said: str) -> None:
        super().__init__(f"{what}{'' if states == 1 else f' of state {state}'}: {said}")
        self.what, self.state, self.said = what, state, said


class Code(Protocol):
    """Compiled code of one call, as :mod:`ksl.drivetrain.compiled_maps` has it."""

    def __call__(self, rows: Sequence[Array], found: Array, threads: int | None) -> Array: ...


class MotionMap:
    """Positions, velocities and accelerations both ways."""

    def __init__(
        self, m: Model, joints: Iterable[str], start: ArrayLike | None = None, ball_limits: Mapping[str, float] | None = None, sharing: Sharing | None = None
    ) -> None:
        self.model, self.sharing = m, sharing
        self.code: Mapping[str, Code] = {}
        """Calls that are compiled."""
        self.part = part = part_of(m, joints)
        self.tree = m.without_loops()
        self.start: Array = self._closed(m.neutral() if start is None else start, start is not None)
        """The closed position (nq) from which positions are followed."""
        self.equations = Equations(m, m.with_physics(None).without_loops(), self.start, part, sharing is not None)
        self.ball_limits = dict(given.mapping(ball_limits or {}, "ball_limits", "{joint: angle}"))
        self.swings = swings_of(self.equations, self.start, self.ball_limits)
        self.joints, self.motors, self.followers = part.joints, part.motors, part.followers
        self.of_joints, self.of_motors = positions_of(self.equations, part.of_joints), positions_of(self.equations, part.of_motors)
        self._require_regular(part.of_joints, self.joints, "joints")
        self.scales = None if sharing is None else scales_of(m, part, sharing)
        self.held_motors = held_motors(self._start_rates, self.scales)
        """Which of the motors say where all is: all of them, where they are as many as the joints."""
        self._require_regular([part.of_motors[i] for i in self.held_motors], self.held_names, "motors")

    def __repr__(self) -> str:
        return f"<ksl actuation of {listed(self.joints)} by {listed(self.motors)}>"

    @property
    def held_names(self) -> list[str]:
        names = [name for name in self.motors for _ in range(self.model.joint(name).nv)]
        return list(dict.fromkeys(names[i] for i in self.held_motors))

    def _closed(self, q: ArrayLike, is_given: bool) -> Array:
        """The closed position nearest to one; a given start must be closed."""
        m = self.model
        start = finite_rows(m.in_order(q, "q"), "start", m.nq)
        if start.ndim != 1:
            raise ValueError(f"start has shape {start.shape}; expected one position, ({m.nq},)")
        found = m.close(start)
        moved = float(np.abs(m.difference(start, found.q)).max(initial=0.0)) if is_given else 0.0
        if not found.converged:
            where = "start" if is_given else "the neutral position"
            raise ValueError(
                f"{where}: no closed position of {m.name or m.file} is found from it ({found.reason}, open by {float(found.error):.3g} m); pass start= of a closed one"
            )
        if moved > 1e-6:
            raise ValueError(f"start is open: the nearest closed position is {moved:.3g} rad or m away; pass m.close(start).q")
        return np.array(found.q, dtype=float)

    def _require_regular(self, held: list[int], names: Sequence[str], what: str) -> None:
        """Refuses a start at which joints, or motors, don't say where all else is."""
        equations, G = self.equations, self.equations.jacobian(self.start[None])[0]
        square = G[:, self.part.without(held)] / np.abs(G).max(axis=1, keepdims=True)
        if len(square) and np.linalg.cond(square) > WORST:
            said = f"{listed(names)} don't say where {equations.part.loops[0].name} and the other joints are at the start"
            raise ValueError(f"{what}: {said}; it is a dead centre, or they follow from each other: pass start= of another position, or name other joints")

    # positions

    def motors_of(
        self, q: ArrayLike, start: ArrayLike | None = None, unreachable: Unreachable = "raise", out: Array | None = None, threads: int | None = None
    ) -> Array:
        """Positions (…, motors) of the motors for q (…, joints), rad or m.

        start (nq): a closed position on the assembly that is meant, instead of the map's own.  unreachable: of positions that the assembly doesn't
        reach, "raise" is a ValueError that names the first; "nan" gives rows of NaN.
        out: a C-contiguous array for the result.  threads: the most that compiled code takes; None or 0 is all cores.

            theta = a.motors_of([0.1, -0.05])
        """
        return self._positions("motors_of", (q, "q"), (self.part.of_joints, self.of_motors), start, unreachable, out, threads)

    def joints_of(
        self, q_motors: ArrayLike, start: ArrayLike | None = None, unreachable: Unreachable = "raise", out: Array | None = None, threads: int | None = None
    ) -> Array:
        """Positions (…, joints) of the joints for those of motors (…, motors); otherwise as :meth:`motors_of`.

        Of motors that are more than the joints all must be where the others put them, within 1e-6 rad or m; else a row is out of reach.
        """
        return self._positions("joints_of", (q_motors, "q_motors"), (self.part.of_motors, self.of_joints), start, unreachable, out, threads)

    def _positions(
        self,
        call: str,
        x: tuple[ArrayLike, str],
        ways: tuple[list[int], list[int]],
        start: ArrayLike | None,
        unreachable: Unreachable,
        out: Array | None,
        threads: int | None,
    ) -> Array:
        """ways: the coordinates that are given, and where those that are wanted are in q."""
        one_of(unreachable, "unreachable", "raise", "nan")
        (held, wanted), at = ways, self.start if start is None else self._closed(start, True)
        rows, leading = rows_of((*x, len(held)))
        otherwise = lambda targets: self._follow(targets, x[1], held, at, unreachable)[:, wanted]
        return self.computed(call if start is None else "", rows, leading, (len(wanted),), otherwise, out, threads)

    def _follow(self, targets: Array, what: str, held: list[int], at: Array, unreachable: Unreachable) -> Array:
        """Positions (n, nq) of the whole model for targets (n, held)."""
        if held == self.part.of_motors and len(self.held_motors) < len(held):
            Q = follow(self.equations, at, [held[i] for i in self.held_motors], targets[:, self.held_motors])
            apart = np.abs(Q[:, self.of_motors] - targets).max(axis=1) > TOGETHER  # not where they are NaN
            if unreachable == "raise" and apart.any():
                k = int(np.argmax(apart))
                said = f"{listed(self.motors)} = {np.array2string(targets[k], precision=6, separator=', ')} contradict each other"
                raise StateError(
                    what, k, len(Q), f"{said}: by {listed(self.held_names)} they are at {np.array2string(Q[k, self.of_motors], precision=6, separator=', ')}"
                )
            Q[apart] = np.nan
        else:
            Q = follow(self.equations, at, held, targets)
        lost = np.isnan(Q).any(axis=1)
        if unreachable == "raise" and lost.any():
            k = int(np.argmax(lost))
            said = f"{listed(self.joints if held == self.part.of_joints else self.motors)} = {np.array2string(targets[k], precision=6, separator=', ')}"
            reach = 'is out of reach on the assembly of the start; range(joint) says how far it reaches, and unreachable="nan" gives NaN for such rows'
            raise StateError(what, k, len(Q), f"{said} {reach}")
        return Q

    def state(self, q: ArrayLike, v: ArrayLike | None = None, a: ArrayLike | None = None, carrier: Carrier | None = None) -> tuple[Array, Array, Array]:
        """Position (…, nq), velocity and acceleration (…, nv) of the whole model, closed, for q, v and a (…, joints); v and a are zero by default.

        carrier: (Q, V, A) of the whole model, of which the numbers of joints outside of the mechanism are taken; by default these are neutral
        and at rest.  Rods with balls at both ends have no spin.
        """
        Q, V, A, leading = self.whole_state(q, v, a, carrier)
        return Q.reshape(*leading, -1), V.reshape(*leading, -1), A.reshape(*leading, -1)

    def whole_state(self, q: ArrayLike, v: ArrayLike | None, a: ArrayLike | None, carrier: Carrier | None) -> tuple[Array, Array, Array, tuple[int, ...]]:
        """Position (n, nq), velocity and acceleration (n, nv) of the whole model, and the leading shape."""
        m, n, equations, own = self.model, len(self.part.of_joints), self.equations, self.part.of_joints
        outer = (m.neutral(), np.zeros(m.nv), np.zeros(m.nv)) if carrier is None else carrier
        if not isinstance(outer, tuple) or len(outer) != 3:
            raise ValueError("carrier: expected (Q, V, A) of the whole model, (nq), (nv) and (nv)")
        inputs = [(q, "q", n), (np.zeros(n) if v is None else v, "v", n), (np.zeros(n) if a is None else a, "a", n)]
        inputs += [(m.in_order(x, what.lower()), f"carrier: its {what}", size) for x, what, size in zip(outer, ("Q", "V", "A"), (m.nq, m.nv, m.nv))]
        arrays, leading = rows_of(*inputs)
        q_, v_, a_, Q_outer, V, A = (np.array(x) for x in arrays)
        Q = self._follow(q_, "q", own, self.start, "raise")
        outside = self._outside if carrier is not None else []
        Q[:, outside] = Q_outer[:, outside]
        if carrier is None:
            V[:], A[:] = 0.0, 0.0
        others = self.part.without(own)
        V[:, self.part.all] = A[:, self.part.all] = 0.0
        V[:, own] = v_
        G = equations.jacobian(Q)
        V[:, others] = -equations.solve(G, own, np.einsum("nrv,nv->nr", G, V)[..., None])[..., 0]
        A[:, own] = a_
        A[:, others] = -equations.solve(G, own, (np.einsum("nrv,nv->nr", G, A) + equations.bias(Q, V))[..., None])[..., 0]
        return Q, V, A, leading

    @cached_property
    def _outside(self) -> list[int]:
        """Numbers in q of joints that the part doesn't move."""
        joints = [joint for joint in self.model.joints if joint.nv and joint.v_index not in self.part.all]
        return [joint.q_index + i for joint in joints for i in range(joint.nq)]

    def motions(self, q: ArrayLike) -> tuple[Array, Array, tuple[int, ...]]:
        """Positions (n, nq), how all coordinates move with the joints (n, nv, joints), and the leading shape."""
        (rows,), leading = rows_of((q, "q", len(self.part.of_joints)))
        Q = self._follow(rows, "q", self.part.of_joints, self.start, "raise")
        return Q, self.equations.motions(Q, self.part.of_joints), leading

    @cached_property
    def _sizes(self) -> Array:
        """Lengths (motors, 1) of the rows of the motors' Jacobian at the start, by which others are judged."""
        return np.asarray(np.linalg.norm(self._start_rates, axis=1, keepdims=True))

    @cached_property
    def _start_rates(self) -> Array:
        """The motors' Jacobian (motors, joints) at the start."""
        rates: Array = self.equations.motions(self.start[None], self.part.of_joints)[0, self.part.of_motors]
        return rates

    def to_motors(self, q: ArrayLike) -> tuple[Array, tuple[int, ...]]:
        """Motors' rates by those of joints, (n, motors, joints)."""
        _, B, leading = self.motions(q)
        return B[:, self.part.of_motors], leading

    def inverse(self, W: Array) -> Array:
        """Joints' rates by those of motors.  Raises ValueError where motors hold nothing."""
        weak = np.linalg.svd(W / self._sizes, compute_uv=False).min(axis=1) < WEAK
        if weak.any():
            said = f"{listed(self.motors)} hold nothing there: joints move while the motors stand still, and no efforts of motors hold them; range(joint) says where that is"
            raise StateError("q", int(np.argmax(weak)), len(W), said)
        return np.asarray(np.linalg.inv(W)) if self.scales is None else inverse_of(W, self.scales)

    def holding(self, W: Array) -> Array:
        """What is zero where motors W (…, motors, joints) hold nothing: the determinant, or, of more motors than joints, the root of that of Wᵀ W."""
        if W.shape[-2] == W.shape[-1]:
            return np.asarray(np.linalg.det(W))
        return np.asarray(np.sqrt(np.maximum(np.linalg.det(W.swapaxes(-1, -2) @ W), 0.0)))

    # rates

    def motor_jacobian(self, q: ArrayLike, out: Array | None = None, threads: int | None = None) -> Array:
        """The Jacobian (…, motors, joints) by which v_motors = J⁻¹ v, the inverse of :meth:`jacobian`; it exists at all q (…, joints)."""
        return self._rates("motor_jacobian", q, (len(self.part.of_motors), len(self.part.of_joints)), lambda W: W, out, threads)

    def jacobian(self, q: ArrayLike, out: Array | None = None, threads: int | None = None) -> Array:
        """The Jacobian J (…, joints, motors) at q (…, joints): v = J v_motors, and τ_motors = Jᵀ τ."""
        return self._rates("jacobian", q, (len(self.part.of_joints), len(self.part.of_motors)), self.inverse, out, threads)

    def _rates(self, call: str, q: ArrayLike, one: tuple[int, ...], by: Callable[[Array], Array], out: Array | None, threads: int | None) -> Array:
        rows, leading = rows_of((q, "q", len(self.part.of_joints)))
        return self.computed(call, rows, leading, one, lambda q: by(self.to_motors(q)[0]), out, threads)

    def jacobian_rate(self, q: ArrayLike, v: ArrayLike) -> Array:
        """The rate dJ/dt (…, joints, motors) of :meth:`jacobian` along a motion with v (…, joints) at q."""
        n = len(self.part.of_joints)
        (rows, rates), leading = rows_of((q, "q", n), (v, "v", n))
        W = self.to_motors(rows)[0]
        J = self.inverse(W)
        size = np.maximum(np.abs(rates).max(axis=1), 1e-12)  # motors' accelerations at a = 0 are quadratic in v: the rate of J⁻¹ by polarisation
        W_rate = np.empty((len(rows), len(self.part.of_motors), n))
        for k in range(n):
            step = np.zeros_like(rates)
            step[:, k] = size
            W_rate[:, :, k] = (self._bent(rows, rates + step) - self._bent(rows, rates - step)) / (4 * size[:, None])
        return inverse_rate(W, W_rate, J, self.scales).reshape(*leading, n, -1)

    def _bent(self, q: Array, v: Array) -> Array:
        """Motors' accelerations (n, motors) of joints that don't accelerate."""
        return self.whole_state(q, v, None, None)[2][:, self.part.of_motors]

    def motor_velocities(self, q: ArrayLike, v: ArrayLike, out: Array | None = None, threads: int | None = None) -> Array:
        """Velocities (…, motors) for v (…, joints) at q."""
        return self.mapped("motor_velocities", q, (v, "v"), "motors", lambda W: W, out, threads)

    def joint_velocities(self, q: ArrayLike, v_motors: ArrayLike, out: Array | None = None, threads: int | None = None) -> Array:
        """Velocities (…, joints) for those of motors (…, motors) at q."""
        return self.mapped("joint_velocities", q, (v_motors, "v_motors"), "joints", self.inverse, out, threads)

    def motor_accelerations(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> Array:
        """Accelerations (…, motors) for v and a (…, joints) at q."""
        _, _, A, leading = self.whole_state(q, v, a, None)
        return A[:, self.part.of_motors].reshape(*leading, -1)

    def joint_accelerations(self, q: ArrayLike, v: ArrayLike, a_motors: ArrayLike) -> Array:
        """Accelerations (…, joints) for v (…, joints) and those of motors (…, motors) at q."""
        n = len(self.part.of_joints)
        (rows, rates, wanted), leading = rows_of((q, "q", n), (v, "v", n), (a_motors, "a_motors", len(self.part.of_motors)))
        J = self.inverse(self.to_motors(rows)[0])
        found: Array = np.einsum("njm,nm->nj", J, wanted - self._bent(rows, rates)).reshape(*leading, -1)
        return found

    # arguments

    def mapped(
        self,
        call: str,
        q: ArrayLike,
        x: tuple[ArrayLike, str],
        to: Literal["motors", "joints"],
        by: Callable[[Array], Array],
        out: Array | None,
        threads: int | None,
    ) -> Array:
        """by(W) (n, rows, columns) of the motors' Jacobians W times numbers x (…, columns), which have a name: the result is of motors, or of joints."""
        joints, motors = len(self.part.of_joints), len(self.part.of_motors)
        columns, found = (joints, motors) if to == "motors" else (motors, joints)
        rows, leading = rows_of((q, "q", joints), (*x, columns))
        return self.computed(call, rows, leading, (found,), lambda q, x: np.einsum("nij,nj->ni", by(self.to_motors(q)[0]), x), out, threads)

    def computed(
        self,
        call: str,
        rows: list[Array],
        leading: tuple[int, ...],
        one: tuple[int, ...],
        otherwise: Callable[..., Array],
        out: Array | None,
        threads: int | None,
    ) -> Array:
        """The result of a call, of the shape `one` for each of the rows (n, numbers): by compiled code, and where there is none, or it finds no position, otherwise."""
        given.threads(threads)
        found = result_array(out, (*leading, *one))
        rows = [x.copy() if np.may_share_memory(x, found) else x for x in rows]
        states = found.reshape(len(rows[0]), *one)
        left = np.arange(len(states))
        if call in self.code:
            left = np.flatnonzero(~(self.code[call](rows, states, threads) < EXACT))
        if not len(left):
            return found
        try:
            states[left] = otherwise(*(x[left] for x in rows))
        except StateError as error:
            raise StateError(error.what, int(left[error.state]), len(states), error.said) from None
        return found


def result_array(out: Array | None, shape: tuple[int, ...]) -> Array:
    """`out`, if it can take a result, or an array of its own."""
    if out is None:
        return np.empty(shape)
    if (
        not isinstance(out, np.ndarray)
        or out.dtype != np.float64
        or out.shape != shape
        or not (out.flags.c_contiguous and out.flags.aligned and out.flags.writeable)
    ):
        found = f"{out.dtype} {out.shape}" if isinstance(out, np.ndarray) else type(out).__name__
        raise ValueError(f"out is {found}; expected a C-contiguous, aligned, writeable float64 array of shape {shape}")
    return out


def rows_of(*inputs: tuple[ArrayLike, str, int]) -> tuple[list[Array], tuple[int, ...]]:
    """Arrays (n, columns), finite, and their common leading shape."""
    arrays = {name: finite_rows(x, name, columns) for x, name, columns in inputs}
    leading = leading_shape(arrays)
    return [np.broadcast_to(x, (*leading, x.shape[-1])).reshape(int(np.prod(leading)), x.shape[-1]) for x in arrays.values()], leading
