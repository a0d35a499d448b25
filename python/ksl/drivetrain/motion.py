"""Positions and rates of motors and joints of one mechanism, through the rods between them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.words import listed
from ksl.drivetrain.assembly import follow, positions_of
from ksl.drivetrain.equations import Equations
from ksl.drivetrain.parts import part_of
from ksl.mechanism.requests import one_of
from ksl.mechanism.states import Array, finite_rows, leading_shape

if TYPE_CHECKING:
    from ksl.model.model import Model

Carrier = tuple[ArrayLike, ArrayLike, ArrayLike]
"""Position, velocity and acceleration of the whole model, of which those of joints that the mechanism doesn't move count."""
Unreachable = Literal["raise", "nan"]
WEAK, WORST = 1e-10, 1e8
"""Rates of motors, relative to those at the start, below which they hold nothing; the condition of equations above which a start is a dead centre."""


class MotionMap:
    """Positions, velocities and accelerations both ways."""

    def __init__(self, m: Model, joints: Iterable[str], start: ArrayLike | None = None) -> None:
        self.model = m
        self.part = part = part_of(m, joints)
        self.tree = m.without_loops()
        self.start: Array = self._closed(m.neutral() if start is None else start, start is not None)
        """The closed position (nq) from which positions are followed."""
        self.equations = Equations(m, m.with_physics(None).without_loops(), self.start, part)
        self.joints, self.motors, self.followers = part.joints, part.motors, part.followers
        self.of_joints, self.of_motors = positions_of(self.equations, part.of_joints), positions_of(self.equations, part.of_motors)
        self._require_regular()

    def __repr__(self) -> str:
        return f"<ksl actuation of {listed(self.joints)} by {listed(self.motors)}>"

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

    def _require_regular(self) -> None:
        """Refuses a start at which joints, or motors, don't say where all else is."""
        equations, G = self.equations, self.equations.jacobian(self.start[None])[0]
        for held, names, what in ((self.part.of_joints, self.joints, "joints"), (self.part.of_motors, self.motors, "motors")):
            square = G[:, self.part.without(held)] / np.abs(G).max(axis=1, keepdims=True)
            if len(square) and np.linalg.cond(square) > WORST:
                said = f"{listed(names)} don't say where {equations.part.loops[0].name} and the other joints are at the start"
                raise ValueError(f"{what}: {said}; it is a dead centre, or they follow from each other: pass start= of another position, or name other joints")

    # positions

    def motors_of(self, q: ArrayLike, start: ArrayLike | None = None, unreachable: Unreachable = "raise") -> Array:
        """Positions (…, motors) of the motors for q (…, joints), rad or m.

        start (nq): a closed position on the assembly that is meant, instead of the map's own.  unreachable: of positions that the assembly doesn't
        reach, "raise" is a ValueError that names the first; "nan" gives rows of NaN.

            theta = a.motors_of([0.1, -0.05])
        """
        return self._followed(q, "q", self.part.of_joints, start, unreachable)[..., self.of_motors]

    def joints_of(self, q_motors: ArrayLike, start: ArrayLike | None = None, unreachable: Unreachable = "raise") -> Array:
        """Positions (…, joints) of the joints for those of motors (…, motors); otherwise as :meth:`motors_of`."""
        return self._followed(q_motors, "q_motors", self.part.of_motors, start, unreachable)[..., self.of_joints]

    def _followed(self, x: ArrayLike, what: str, held: list[int], start: ArrayLike | None, unreachable: Unreachable = "raise") -> Array:
        """Positions (…, nq) of the whole model."""
        (targets,), leading = rows_of((x, what, len(held)))
        at = self.start if start is None else self._closed(start, True)
        Q = follow(self.equations, at, held, targets)
        lost = np.isnan(Q).any(axis=1)
        if one_of(unreachable, "unreachable", "raise", "nan") == "raise" and lost.any():
            k = int(np.argmax(lost))
            names = self.joints if held == self.part.of_joints else self.motors
            said = f"{what}{'' if len(Q) == 1 else f' of state {k}'}: {listed(names)} = {np.array2string(targets[k], precision=6, separator=', ')}"
            raise ValueError(
                f'{said} is out of reach on the assembly of the start; range(joint) says how far it reaches, and unreachable="nan" gives NaN for such rows'
            )
        return Q.reshape(*leading, self.model.nq)

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
        Q = self._followed(q_, "q", own, None)
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
        Q = self._followed(rows, "q", self.part.of_joints, None)
        return Q, self.equations.motions(Q, self.part.of_joints), leading

    @cached_property
    def _sizes(self) -> Array:
        """Lengths (motors, 1) of the rows of the motors' Jacobian at the start, by which others are judged."""
        W = self.equations.motions(self.start[None], self.part.of_joints)[0, self.part.of_motors]
        return np.asarray(np.linalg.norm(W, axis=1, keepdims=True))

    def to_motors(self, q: ArrayLike) -> tuple[Array, tuple[int, ...]]:
        """Motors' rates by those of joints, (n, motors, joints)."""
        _, B, leading = self.motions(q)
        return B[:, self.part.of_motors], leading

    def inverse(self, W: Array) -> Array:
        """Joints' rates by those of motors.  Raises ValueError where motors hold nothing."""
        weak = np.linalg.svd(W / self._sizes, compute_uv=False).min(axis=1) < WEAK
        if weak.any():
            state = "" if len(W) == 1 else f" of state {int(np.argmax(weak))}"
            raise ValueError(
                f"q{state}: {listed(self.motors)} hold nothing there: joints move while the motors stand still, and no efforts of motors hold them; range(joint) says where that is"
            )
        return np.asarray(np.linalg.inv(W))

    # rates

    def motor_jacobian(self, q: ArrayLike) -> Array:
        """The Jacobian (…, motors, joints) by which v_motors = J⁻¹ v, the inverse of :meth:`jacobian`; it exists at all q (…, joints)."""
        W, leading = self.to_motors(q)
        return W.reshape(*leading, *W.shape[1:])

    def jacobian(self, q: ArrayLike) -> Array:
        """The Jacobian J (…, joints, motors) at q (…, joints): v = J v_motors, and τ_motors = Jᵀ τ."""
        W, leading = self.to_motors(q)
        return self.inverse(W).reshape(*leading, W.shape[2], W.shape[1])

    def jacobian_rate(self, q: ArrayLike, v: ArrayLike) -> Array:
        """The rate dJ/dt (…, joints, motors) of :meth:`jacobian` along a motion with v (…, joints) at q."""
        n = len(self.part.of_joints)
        (rows, rates), leading = rows_of((q, "q", n), (v, "v", n))
        J = self.inverse(self.to_motors(rows)[0])
        size = np.maximum(np.abs(rates).max(axis=1), 1e-12)  # motors' accelerations at a = 0 are quadratic in v: the rate of J⁻¹ by polarisation
        W_rate = np.empty((len(rows), len(self.part.of_motors), n))
        for k in range(n):
            step = np.zeros_like(rates)
            step[:, k] = size
            W_rate[:, :, k] = (self._bent(rows, rates + step) - self._bent(rows, rates - step)) / (4 * size[:, None])
        return np.asarray(-J @ W_rate @ J).reshape(*leading, n, -1)

    def _bent(self, q: Array, v: Array) -> Array:
        """Motors' accelerations (n, motors) of joints that don't accelerate."""
        return self.whole_state(q, v, None, None)[2][:, self.part.of_motors]

    def motor_velocities(self, q: ArrayLike, v: ArrayLike) -> Array:
        """Velocities (…, motors) for v (…, joints) at q."""
        return self.mapped(q, v, "v", lambda W: W)

    def joint_velocities(self, q: ArrayLike, v_motors: ArrayLike) -> Array:
        """Velocities (…, joints) for those of motors (…, motors) at q."""
        return self.mapped(q, v_motors, "v_motors", self.inverse)

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

    def mapped(self, q: ArrayLike, x: ArrayLike, what: str, by: Callable[[Array], Array]) -> Array:
        """by(W) (n, rows, columns) of the motors' Jacobians W times numbers x (…, columns)."""
        n = len(self.part.of_joints)
        (rows, numbers), leading = rows_of((q, "q", n), (x, what, n))
        found: Array = np.einsum("nij,nj->ni", by(self.to_motors(rows)[0]), numbers).reshape(*leading, -1)
        return found


def rows_of(*inputs: tuple[ArrayLike, str, int]) -> tuple[list[Array], tuple[int, ...]]:
    """Arrays (n, columns), finite, and their common leading shape."""
    arrays = {name: finite_rows(x, name, columns) for x, name, columns in inputs}
    leading = leading_shape(arrays)
    return [np.broadcast_to(x, (*leading, x.shape[-1])).reshape(int(np.prod(leading)), x.shape[-1]) for x in arrays.values()], leading
