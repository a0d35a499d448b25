"""Efforts of motors and joints, inertia, and limits that follow the configuration."""

from __future__ import annotations

from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ksl.drivetrain.boxes import corners, crossings, half_widths, sides
from ksl.drivetrain.motion import Carrier, MotionMap
from ksl.drivetrain.rods_cut import RodsCut
from ksl.mechanism.requests import one_of
from ksl.mechanism.states import Array

Share = Literal["all", "rotors", "rods"]
Limited = Literal["effort", "velocity"]


class EffortMap(MotionMap):
    """The motion's map with efforts, inertia and limits."""

    # efforts

    def static_motor_efforts(self, q: ArrayLike, tau: ArrayLike, out: Array | None = None, threads: int | None = None) -> Array:
        """Efforts (…, motors) that hold efforts tau (…, joints) at q by virtual power, τ_motors = Jᵀ τ; nothing of rods and rotors.

        Of motors that are more than the joints, those that `sharing` says: of all that hold tau the ones with the least sum of squares, each by its scale.
        """
        return self.mapped("static_motor_efforts", q, (tau, "tau"), "motors", lambda W: self.inverse(W).swapaxes(1, 2), out, threads)

    def static_joint_efforts(self, q: ArrayLike, tau_motors: ArrayLike, out: Array | None = None, threads: int | None = None) -> Array:
        """Efforts (…, joints) that those of motors (…, motors) give at q, τ = J⁻ᵀ τ_motors."""
        return self.mapped("static_joint_efforts", q, (tau_motors, "tau_motors"), "joints", lambda W: W.swapaxes(1, 2), out, threads)

    def motor_efforts(self, q: ArrayLike, v: ArrayLike, a: ArrayLike, carrier: Carrier | None = None) -> Array:
        """Efforts (…, motors) that the motion q, v, a (…, joints) needs: of all bodies, rods and cranks included, and of what physics= names.

        carrier: (Q, V, A) of the whole model, of what carries the mechanism; by default neutral and at rest.
        By virtual power of the whole tree, so that reactions that rigid bodies leave open don't matter.
        """
        Q, V, A, leading = self.whole_state(q, v, a, carrier)
        efforts = self.tree.inverse_dynamics(Q, V, A)
        B = self.equations.motions(Q, self.part.of_joints)
        found: Array = np.einsum("njm,nvj,nv->nm", self.inverse(B[:, self.part.of_motors]), B, efforts, optimize=True).reshape(*leading, -1)
        return found

    def loop_forces(self, q: ArrayLike, v: ArrayLike, a: ArrayLike, carrier: Carrier | None = None) -> Array:
        """Forces (…, loops) in the joints that close loops, in the order of `loops`, for the motion q, v, a (…, joints): magnitudes, N.

        They are what rods pull or push with at their ends.  Of planar loops it is the force in the plane; rigid bodies don't determine that across it.
        """
        Q, V, A, leading = self.whole_state(q, v, a, carrier)
        others = self.part.without([self.part.of_motors[i] for i in self.held_motors])
        G, efforts = self.equations.jacobian(Q)[:, :, others], np.array(self.tree.inverse_dynamics(Q, V, A))
        B = self.equations.motions(Q, self.part.of_joints)
        J = self.inverse(B[:, self.part.of_motors])
        if len(self.held_motors) < len(self.part.of_motors):  # those that aren't held have efforts, too
            efforts[:, self.part.of_motors] -= np.einsum("njm,nvj,nv->nm", J, B, efforts, optimize=True)
        efforts = efforts[:, others]
        multipliers = np.linalg.solve(G.swapaxes(1, 2), efforts[..., None])[..., 0]
        forces = [np.linalg.norm(x, axis=1) for x in self.equations.forces(multipliers)]
        return np.stack(forces, axis=1).reshape(*leading, -1) if forces else np.zeros((*leading, 0))

    @property
    def loops(self) -> tuple[str, ...]:
        """The joints that close the loops of the mechanism."""
        return tuple(loop.name for loop in self.part.loops)

    def serial_efforts(self, q: ArrayLike, v: ArrayLike, a: ArrayLike, carrier: Carrier | None = None) -> Array:
        """Efforts (…, joints) of the tree whose rods and cranks are cut off, without rotors, for the same motion."""
        Q, V, A, leading = self.whole_state(q, v, a, carrier)
        return np.asarray(self.rods_cut.without_rods.inverse_dynamics(Q, V, A))[:, self.part.of_joints].reshape(*leading, -1)

    def lost_efforts(self, q: ArrayLike, v: ArrayLike, a: ArrayLike, carrier: Carrier | None = None) -> Array:
        """By how much (…, motors) the static map errs: :meth:`motor_efforts` less Jᵀ times :meth:`serial_efforts`.

        At rest it is the weight of rods and cranks.
        """
        return self.motor_efforts(q, v, a, carrier) - self.static_motor_efforts(q, self.serial_efforts(q, v, a, carrier))

    def reflected_inertia(self, q: ArrayLike, of: Share = "all") -> Array:
        """What rotors, through their gears, and rods feel like at the joints, (…, joints, joints), kg m², with what carries them at rest.

        of: "rotors" (and armatures), whatever physics= names; "rods", with cranks; or "all", the sum.
        """
        one_of(of, "of", "all", "rotors", "rods")
        Q, B, leading = self.motions(q)
        found = np.zeros((len(Q), B.shape[2], B.shape[2]))
        if of != "rods":
            found += np.einsum("nvj,v,nvk->njk", B, self.rods_cut.rotors, B)
        if of != "rotors":
            found += np.einsum("nvj,nvw,nwk->njk", B, np.asarray(self.rods_cut.rods_alone.mass_matrix(Q)), B)
        return found.reshape(*leading, *found.shape[1:])

    @cached_property
    def rods_cut(self) -> RodsCut:
        """The trees of rods and cranks, and of all else."""
        return RodsCut(self.model, self.part)

    def reflected_damping(self) -> dict[str, float]:
        """{joint: damping} at the start: what motors' and other joints' damping feels like there, without what it couples; N m s/rad or N s/m."""
        damping = np.zeros(self.model.nv)
        for joint in self.model.joints:
            if joint.nv:
                damping[joint.v_index : joint.v_index + joint.nv] = joint.damping
        B = self.equations.motions(self.start[None], self.part.of_joints)[0]
        return {
            joint.name: float(B[:, k] @ (damping * B[:, k]))
            for k, i in enumerate(self.part.of_joints)
            for joint in self.model.joints
            if joint.nv and joint.v_index == i
        }

    # limits

    def effort_polytope(self, q: ArrayLike) -> Array:
        """Vertices (…, 2^motors, joints) of the efforts that motors' effort limits allow at the joints; gravity is not subtracted.

        Of motors that are more than the joints it is the convex hull of these points, some of which lie within it: all ways of sharing count, not only that of `sharing`.
        """
        W, leading = self.to_motors(q)
        found = corners(self._checked(W).swapaxes(1, 2), self._limits("effort"))
        return found.reshape(*leading, *found.shape[1:])

    def velocity_polytope(self, q: ArrayLike) -> Array:
        """Vertices (…, 2^motors, joints) of the velocities that motors' velocity limits allow at the joints.

        Of motors that are more than the joints it is the convex hull of points (…, C(motors, joints) 2^joints, joints), some of which lie on its sides.
        """
        W, leading = self.to_motors(q)
        J, limits = self.inverse(W), self._limits("velocity")
        found = corners(J, limits) if W.shape[1] == W.shape[2] else crossings(W, limits)
        return found.reshape(*leading, *found.shape[1:])

    def effort_box(self, q: ArrayLike) -> Array:
        """The largest box by volume in :meth:`effort_polytope`, (…, joints, 2), lower and upper: limits of single joints that hold together."""
        W, leading = self.to_motors(q)
        return _sides(half_widths(*self._effort_sides(W)), leading)

    def velocity_box(self, q: ArrayLike) -> Array:
        """The largest box by volume in :meth:`velocity_polytope`, (…, joints, 2)."""
        W, leading = self.to_motors(q)
        return _sides(half_widths(self._checked(W), self._limits("velocity")), leading)

    def _checked(self, W: Array) -> Array:
        self.inverse(W)
        return W

    def effort_alone(self, q: ArrayLike) -> Array:
        """The largest efforts (…, joints) of each joint alone, while the others have none, that motors' effort limits allow at q."""
        W, leading = self.to_motors(q)
        return _alone(*self._effort_sides(W), leading)

    def _effort_sides(self, W: Array) -> tuple[Array, Array]:
        """Rows (n, sides, joints) whose products with efforts of joints keep ± limits (sides): the sides of the polytope of efforts."""
        J, limits = self.inverse(W), self._limits("effort")
        return (J.swapaxes(1, 2), limits) if W.shape[1] == W.shape[2] else sides(W.swapaxes(1, 2), limits)

    def velocity_alone(self, q: ArrayLike) -> Array:
        """The largest velocities (…, joints) of each joint alone, while the others stand still, that motors' velocity limits allow at q."""
        W, leading = self.to_motors(q)
        return _alone(W, self._limits("velocity"), leading)

    def has_limits(self, what: Limited) -> bool:
        """Whether all motors have limits of efforts, or of velocities."""
        limits = self.model.effort_limit if what == "effort" else self.model.velocity_limit
        return bool(np.isfinite(limits[self.part.of_motors]).all())

    def _limits(self, what: Limited) -> Array:
        limits = (self.model.effort_limit if what == "effort" else self.model.velocity_limit)[self.part.of_motors]
        if not np.isfinite(limits).all():
            motor = self.motors[int(np.argmin(np.isfinite(limits)))]
            raise ValueError(f"motor {motor!r}: it has no {what} limit, so that {what}s of the joints have none; give it one in the file")
        return limits


def _sides(half: Array, leading: tuple[int, ...]) -> Array:
    return np.stack([-half, half], axis=-1).reshape(*leading, half.shape[1], 2)


def _alone(to_motors: Array, limits: Array, leading: tuple[int, ...]) -> Array:
    """What each column (n, motors, joints) alone may be."""
    with np.errstate(divide="ignore"):
        found: Array = (limits[:, None] / np.abs(to_motors)).min(axis=1)
    return found.reshape(*leading, -1)
