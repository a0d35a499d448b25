"""A mechanism whose joints give way about a pose, in independent displacements: masses, stiffnesses, what keeps loops closed."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ksl.mechanism.calls import Calls
from ksl.mechanism.gear_classes import has_classes
from ksl.mechanism.loops import SAME, length_of
from ksl.mechanism.states import Array
from ksl.mechanism.stiffness import Flexibility, Stiffness, all_flexibilities_of, flexibilities_of, steady_motion
from ksl.small_motions.closure import Closure, closure
from ksl.small_motions.directions import Directions, cross, directions_of, floats, has_motor, spring_load
from ksl.small_motions.giving_way import ZERO
from ksl.small_motions.second_derivatives import force_elements, gravity


def flexibilities(model: Calls, stiffness: Mapping[str, Stiffness] | None, held_at: Array | None = None) -> dict[str, Flexibility]:
    """How joints give way: those that are given, or else those of the model.

    held_at (nq): a pose, whose weight is the load of gears in classes of torque; without one they are without load.
    """
    if stiffness is not None:
        rest = np.zeros(model.nv)
        efforts: dict[str, float] = {}
        if held_at is not None and has_classes(stiffness):
            tau, followers = model.inverse_dynamics(held_at, rest, rest), [joint for joint in model.joints if joint.leader is not None]
            through = np.asarray(model.reactions(held_at, rest, rest, joints=[joint.name for joint in followers]))
            efforts = {joint.name: float(tau[joint.v_index]) for joint in model.joints if joint.nv == 1}
            efforts |= {joint.name: float((steady_motion(joint).T @ f)[0]) + spring_load(model, joint, held_at) for joint, f in zip(followers, through)}
        return flexibilities_of(model, stiffness, efforts)
    return all_flexibilities_of(model)


@dataclass(frozen=True)
class Elastic:
    """n independent displacements, of which those that keep the loops closed are combinations of `closed`."""

    model: Calls
    q: Array
    to: Directions
    loops: list[Closure]

    @cached_property
    def closed(self) -> Array:
        """(n, m)."""
        n = self.to.factors.shape[1]
        rows = np.vstack([np.zeros((0, n)), *(loop.rigid.T @ loop.displacement @ self.to.factors for loop in self.loops)])
        if not rows.any():
            return np.eye(n)
        size, whole = np.linalg.norm(rows, axis=0), np.sqrt((self.to.column**2).sum(axis=0) @ self.to.factors**2)
        counts = size > ZERO * whole  # what is below is rounding, and must not be scaled up
        rows = rows * counts
        scale = 1 / np.where(counts, size, whole)
        _, values, V = np.linalg.svd(rows * scale)
        return np.asarray(scale[:, None] * V[int((values > ZERO * values[0]).sum()) :].T)

    @cached_property
    def springs(self) -> Array:
        """(n, n): of joints of the tree and of loops."""
        K = self.to.stiffness.copy()
        for loop in self.loops:
            factors = factors_of(loop) @ self.to.factors
            K += factors.T @ loop.way.stiffness @ factors
        return K

    @cached_property
    def elements(self) -> tuple[Array, Array, Array]:
        """Gradient (n) and second derivatives (n, n) of force elements, and what of these is their stiffness alone."""
        L = self.to.factors
        if "force elements" not in self.model.physics or not self.model.force_elements:
            return np.zeros(L.shape[1]), np.zeros((L.shape[1],) * 2), np.zeros((L.shape[1],) * 2)
        G, H, material = force_elements(self.model, self.to, self.q)
        return G @ L, L.T @ H @ L, L.T @ material @ L

    def stiffness(self, g: Array) -> Array:
        """(n, n) with the second derivative of the potential of weight along the closed mechanism."""
        L = self.to.factors
        G, H = gravity(self.model, self.to, g)
        gradient, second = G @ L + self.elements[0] + self.to.pull, L.T @ H @ L + self.elements[1]
        for loop, wrench in zip(self.loops, self._wrenches(gradient)):
            second += L.T @ (loop.second @ wrench) @ L
        return self.springs + (second + second.T) / 2

    def _wrenches(self, gradient: Array) -> list[Array]:
        """Wrenches (6) of the loops that hold what no joint of the tree holds; of these the ones of least energy, then of least norm.

        Motors hold, with a stiffness or without, and stiffnesses that are given, whose preload isn't known; springs of the physics have the one that they have.
        """
        if not self.loops:
            return []
        shares = [loop.resists.T @ loop.displacement @ self.to.factors for loop in self.loops]
        A = np.vstack(shares)
        held = self.to.driven | self.to.own_stiffness.any(axis=0)
        found = np.linalg.lstsq(A[:, ~held].T, -gradient[~held], rcond=1e-12)[0]
        rest = _null_space(A[:, ~held].T)
        root = _inverse_root(self.to.own_stiffness[np.ix_(held, held)])
        energy = np.vstack([root @ A[:, held].T, *_roots(self.loops)])
        left = energy @ found + np.concatenate([root @ gradient[held], np.zeros(len(energy) - len(root))])
        U, size, V = np.linalg.svd(energy @ rest, full_matrices=False)
        counts = size > ZERO * np.linalg.norm(energy)  # what is below is rounding: these wrenches store nothing
        found = found - rest @ (V[counts].T @ (U[:, counts].T @ left / size[counts]))
        ends = np.cumsum([loop.resists.shape[1] for loop in self.loops])[:-1]
        return [loop.resists @ x for loop, x in zip(self.loops, np.split(found, ends))]

    @cached_property
    def mass(self) -> tuple[Array, Array]:
        """(n, n), of links and of what turns with joints, as physics says; and what its terms are before they cancel, which rounding is relative to."""
        d = len(self.to.joint)
        M, terms = np.zeros((d, d)), np.zeros((d, d))
        for J, inertia in zip(self.to.twists, self.inertia):
            M += J.T @ inertia @ J
            terms += np.abs(J.T) @ np.abs(inertia) @ np.abs(J)
        for joint in self.model.joints:
            extra = ("armature" in self.model.physics) * joint.armature + ("rotor" in self.model.physics) * joint.rotor_inertia * joint.gear_ratio**2
            if extra:
                rows = self.to.coordinate_rows[joint.name]
                M += extra * rows.T @ rows
        L = self.to.factors
        return L.T @ M @ L, np.abs(L.T) @ terms @ np.abs(L)

    @cached_property
    def inertia(self) -> Array:
        """(links, 6, 6), about their origins in their axes, linear first."""
        out = np.zeros((len(self.model.links), 6, 6))
        for I, link in zip(out, self.model.links):
            xx, yy, zz, xy, yz, zx = link.inertia
            c = cross(np.array(link.first_moment))
            I[:3, :3], I[:3, 3:], I[3:, :3] = link.mass * np.eye(3), -c, c
            I[3:, 3:] = [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]
        return out

    def names(self, displacement: Array) -> tuple[str, ...]:
        """The joints that move in a displacement (n) by more than a thousandth of the one that moves most, with the lengths of directions."""
        size = np.linalg.norm(self.to.column[:, : len(displacement)] * displacement, axis=0)
        moving = {int(i) for i in self.to.owner[size > 1e-3 * size.max(initial=0.0)]}
        return tuple(joint.name for i, joint in enumerate(self.model.joints) if i in moving)


def elastic(model: Calls, q: Array, flexible: Mapping[str, Flexibility]) -> Elastic:
    """The mechanism about the pose q (nq).  Raises ValueError where loops are open."""
    if model.loops:
        opened = float(np.abs(model.loop_error(q)).max(initial=0.0))
        if opened > SAME * max(1.0, length_of(model)):
            raise ValueError(f"q: the loops are open by {opened:.3g} m or rad; m.close(q) gives the nearest closed position")
    to = directions_of(model, q, flexible)
    return Elastic(model, q, to, [closure(model, to, loop, flexible.get(loop.name)) for loop in model.loops])


def falls(model: Calls, held: Collection[str]) -> str:
    """The name of a floating joint that nothing holds, so that no pose is at rest under weight; empty if there is none."""
    return next((joint.name for joint in model.joints if floats(joint) and not has_motor(model, joint) and not model.loops and joint.name not in held), "")


def factors_of(loop: Closure) -> Array:
    """(n, d): the factors of the directions in which a joint of a loop gives way."""
    size = np.linalg.norm(loop.way.directions, axis=0)
    factors: Array = np.linalg.pinv(loop.way.directions / size) @ loop.displacement / size[:, None]
    return factors


def _roots(loops: list[Closure]) -> list[Array]:
    """Rows whose sum of squares, of the wrenches of all loops, is twice the energy that these store."""
    out, before = [], 0
    total = sum(loop.resists.shape[1] for loop in loops)
    for loop in loops:
        resists = loop.way.stiffness.any(axis=0)
        K = loop.way.stiffness[np.ix_(resists, resists)]
        root = _inverse_root(K)
        rows = np.zeros((len(root), total))
        rows[:, before : before + loop.resists.shape[1]] = root @ loop.way.directions[:, resists].T @ loop.resists
        out.append(rows)
        before += loop.resists.shape[1]
    return out


def _inverse_root(K: Array) -> Array:
    """Rows A with Aᵀ A = K⁻¹ where K resists, so that the energy of forces f is ½ |A f|²."""
    values, V = np.linalg.eigh(K)
    kept = values > ZERO * values.max(initial=0.0)
    rows: Array = (V[:, kept] / np.sqrt(values[kept])).T
    return rows


def _null_space(A: Array) -> Array:
    _, size, V = np.linalg.svd(A)
    rest: Array = V[int((size > ZERO * size.max(initial=0.0)).sum()) :].T
    return rest
