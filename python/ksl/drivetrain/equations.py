"""The equations of a part: those of its loops that are independent, and that idle rods don't spin.

At a position Q they are G(Q) V = 0, with as many rows as the coordinates of the part less its freedoms.  With the joints held, or the motors,
the other columns are square: they are solved for the others, and their determinants are zero where a motor is at its dead centre (`reach`)
and where motors hold nothing (`hold`).
"""

from __future__ import annotations

import numpy as np

from ksl.drivetrain.idle import IdleRod, idle_rods
from ksl.drivetrain.parts import Part, require_enough
from ksl.mechanism.calls import Calls
from ksl.mechanism.freedoms import freedoms
from ksl.mechanism.joint_kinds import slides
from ksl.mechanism.mechanism import Loop
from ksl.mechanism.states import Array


def _forces(loop: Loop) -> list[float]:
    """The force in each of the equations of lengths, of a multiplier of one: they are unit wrenches, of a screw with pitch p along its axis f (z, −p z), which is the third."""
    return [1.0 / np.hypot(1.0, loop.pitch if k == 2 else 0.0) for k in range(3 - slides(loop.kind))]


class Equations:
    """Equations of a part, for batches of positions (n, nq)."""

    def __init__(self, m: Calls, tree: Calls, q: Array, part: Part, shared: bool = False) -> None:
        """shared: whether motors may be more than the freedoms."""
        self.m, self.tree, self.part = m, tree, part
        mobility = m.mobility(q)
        redundant, names = set(mobility.redundant_rows), {loop.name for loop in part.loops}
        rows = [(loop.name, i) for loop in m.loops for i in range(loop.equations)]
        self.rows = [k for k, row in enumerate(rows) if row[0] in names and row not in redundant]
        self.rods: list[IdleRod] = idle_rods(m, part)
        self.length = mobility.length or 1.0
        left = len(part.all) - len(self.rows) - len(self.rods)
        if left != len(part.of_joints) and mobility.mobility > freedoms(m):
            raise ValueError(
                f"the equations of {part.loops[0].name} lose rank at the start, where the mechanism has a freedom for an instant; pass start= of another closed position"
            )
        require_enough(m, part, left, shared)

    def forces(self, multipliers: Array) -> list[Array]:
        """For each loop of the part the forces (n, …) of multipliers (n, rows): of lengths, the first rows of its joint that are along directions that it resists."""
        found: list[Array] = []
        start = 0
        for loop in self.m.loops:
            if loop in self.part.loops:
                rows = [(self.rows.index(start + k), force) for k, force in enumerate(_forces(loop)) if start + k in self.rows]
                found.append(multipliers[:, [row for row, _ in rows]] * [force for _, force in rows])
            start += loop.equations
        return found

    def jacobian(self, Q: Array) -> Array:
        """G (n, rows, nv)."""
        spins = [np.einsum("k,nkj->nj", rod.direction, self.tree.jacobian(Q, rod.link)[:, 3:])[:, None] for rod in self.rods]
        return np.concatenate([self.m.loop_jacobian(Q)[:, self.rows], *spins], axis=1)

    def errors(self, Q: Array) -> Array:
        """Errors (n, rows) of positions; how far an idle rod has turned is none."""
        errors = self.m.loop_error(Q)[:, self.rows]
        return np.concatenate([errors, np.zeros((len(Q), len(self.rods)))], axis=1)

    def bias(self, Q: Array, V: Array) -> Array:
        """Ġ V (n, rows).  The row of an idle rod is its spin about its own line, which turns with it: the rod's angular acceleration along the line."""
        at_rest = np.zeros_like(V)
        spins = [self.tree.frame_acceleration(Q, V, at_rest, rod.link)[:, 3:] @ rod.direction for rod in self.rods]
        return np.concatenate([self.m.loop_acceleration(Q, V, at_rest)[:, self.rows], *(x[:, None] for x in spins)], axis=1)

    def solve(self, G: Array, held: list[int], right: Array) -> Array:
        """The coordinates (n, others, …) that are not held, of G_others x = right (n, rows, …); NaN where G is singular."""
        square = G[:, :, self.part.without(held)]
        try:
            return np.asarray(np.linalg.solve(square, right))
        except np.linalg.LinAlgError:
            pass
        found = np.full(right.shape, np.nan)
        for k in range(len(G)):
            try:
                found[k] = np.linalg.solve(square[k], right[k])
            except np.linalg.LinAlgError:
                continue
        return found

    def sign(self, G: Array, held: list[int]) -> Array:
        """The sign (n) of the determinant with these coordinates held: it changes where they stop to say where all others are."""
        return np.asarray(np.linalg.slogdet(G[:, :, self.part.without(held)])[0])

    def motions(self, Q: Array, held: list[int]) -> Array:
        """How all coordinates move with those held, (n, nv, held): the identity for these, zero outside of the part."""
        G = self.jacobian(Q)
        out = np.zeros((len(Q), self.m.nv, len(held)))
        out[:, held, np.arange(len(held))] = 1.0
        out[:, self.part.without(held)] = -self.solve(G, held, G[:, :, held])
        return out
