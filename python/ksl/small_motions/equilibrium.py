"""Poses at rest under weight, springs, force elements and given efforts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ksl.mechanism.calls import Calls
from ksl.mechanism.loops import one_position, one_row
from ksl.mechanism.states import Array, External, ExternalAxes
from ksl.model.poses_at_rest import Equilibrium

STEPS = 60
LONGEST = 0.5
"""rad or m, of a step of the search."""
HALVES = 30
ROUNDING = 1e-11
"""Efforts that are left, relative to the largest that take part."""


@np.errstate(over="ignore", invalid="ignore")  # what is not finite is an error at the end
def equilibrium(
    model: Calls, q: ArrayLike, tau: ArrayLike | None = None, external: External | None = None, external_axes: ExternalAxes = "link"
) -> Equilibrium:
    """See :meth:`ksl.Model.equilibrium`."""
    at = one_position(model, q)
    balance = _Balance(model, one_row(model, tau, "tau"), external, external_axes)
    closed = not model.loops
    if model.loops:
        nearest = model.close(at)
        at, closed = nearest.q, bool(nearest.converged)
    at, left, K, reason = _search(balance, at) if closed else (at, *balance.at(at), "loops")
    stable = bool(len(K) == 0 or (np.linalg.eigvalsh((K + K.T) / 2) > 1e-12 * np.abs(K).max()).all())
    return Equilibrium(at, reason == "at rest", reason, left, balance.independent(at), K, stable and reason == "at rest")


def _search(balance: _Balance, at: Array) -> tuple[Array, Array, Array, str]:
    """Newton's method: where it ended, what is left there, the stiffness, and how it ended."""
    left, K = balance.at(at)
    for _ in range(STEPS):
        step = np.linalg.lstsq(K, left, rcond=1e-12)[0]
        length = float(np.abs(step).max(initial=0.0))
        found = _shorter(balance, at, left, step * min(1.0, LONGEST / length)) if length > 0 else None
        if found is None:  # nothing is left but rounding, or what is left has a minimum
            return at, left, K, "at rest" if np.abs(left).max(initial=0.0) <= ROUNDING * balance.size(at) else "not found"
        at, left, K = found
    return at, left, K, "steps"


def _shorter(balance: _Balance, at: Array, left: Array, step: Array) -> tuple[Array, Array, Array] | None:
    """Where less is left, along a step or a part of it: pose, efforts, stiffness.  A step ends where a force element has no force, too."""
    for _ in range(HALVES):
        try:
            other = balance.moved(at, step)
            rest, K = balance.at(other)
        except ValueError:
            rest, K = np.full_like(left, np.inf), left
        if np.linalg.norm(rest) < np.linalg.norm(left):
            return other, rest, K
        step = step / 2
    return None


@dataclass(frozen=True)
class _Balance:
    """The efforts that no pose holds, and their stiffness."""

    model: Calls
    tau: Array
    external: External | None
    axes: ExternalAxes

    def independent(self, q: Array) -> NDArray[np.intp]:
        return self.model.independent(q) if self.model.loops else np.arange(self.model.nv, dtype=np.intp)

    def at(self, q: Array) -> tuple[Array, Array]:
        """(n), (n, n): efforts that are left, and the stiffness of the pose."""
        rest = np.zeros(self.model.nv)
        if not self.model.loops:
            held = self.model.inverse_dynamics(q, rest, rest, self.external, external_axes=self.axes)
            return self.tau - held, self.model.inverse_dynamics_derivatives(q, rest, rest, self.external, external_axes=self.axes)[0]
        own = self.independent(q)
        a = self.model.forward_dynamics(q, rest, self.tau, self.external, external_axes=self.axes)
        by_q, _, by_tau = self.model.forward_dynamics_derivatives(q, rest, self.tau, self.external, external_axes=self.axes)
        M = np.linalg.inv(by_tau[np.ix_(own, own)])
        return M @ a[own], -M @ by_q[own]

    def moved(self, q: Array, step: Array) -> Array:
        """Another pose, by a step (n) of the independent coordinates; the loops stay closed."""
        if not self.model.loops:
            return self.model.integrate(q, step)
        own, velocity = self.independent(q), np.zeros(self.model.nv)
        velocity[own] = step
        closed = self.model.close(self.model.integrate(q, self.model.consistent_velocity(q, velocity, own)), hold=own, starts=1)
        if not closed.converged:
            raise ValueError("no closed position of the loops was found")
        return closed.q

    def size(self, q: Array) -> float:
        """The efforts that weight and stiffness are of, which rounding is relative to, N m or N."""
        weight = self.model.mass * float(np.linalg.norm(self.model.gravity)) * max(1.0, float(np.ptp(self.model.frame_poses(q)[:, :3, 3], axis=0).max()))
        return float(max(np.abs(self.tau).max(initial=0.0), weight, np.abs(self.at(q)[1]).max(initial=0.0)))
