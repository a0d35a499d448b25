"""Derivatives of motions at a state, by the independent coordinates, their rates, and inputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ksl.mechanism.calls import Calls
from ksl.mechanism.joint_kinds import KINDS, places_in_twist
from ksl.mechanism.states import Array
from ksl.small_motions.directions import cross


@dataclass(frozen=True)
class Tangent:
    """At a state; n independent coordinates, of which others follow.  Rows are of all nv coordinates."""

    q: Array
    v: Array
    acceleration: Array
    independent: NDArray[np.intp]
    """(n) Indices into v."""
    closed: Array
    """(nv, n): velocities by those of the independent coordinates."""
    turning: Array
    """(nv, n): what rates of q ⊖ q₀ lack of velocities, by q; zero but for spherical, planar and floating joints."""
    velocity_by_q: Array
    acceleration_by_q: Array
    acceleration_by_v: Array
    """(nv, n) each."""
    acceleration_by_tau: Array
    """(nv, inputs)."""

    @property
    def free(self) -> int:
        return len(self.independent)


def tangent(model: Calls, q: Array, v: Array, tau: Array, inputs: Sequence[int]) -> Tangent:
    """At the state q (nq), v (nv), under efforts tau (nv).  Raises ValueError for rates that open loops."""
    a = np.asarray(model.forward_dynamics(q, v, tau))
    by_q, by_v, by_tau = (np.asarray(x) for x in model.forward_dynamics_derivatives(q, v, tau))
    ad = _brackets(model, v)
    if not model.loops:
        return Tangent(q, v, a, np.arange(model.nv), np.eye(model.nv), ad / 2, np.zeros((model.nv, model.nv)), by_q, by_v, by_tau[:, inputs])
    own = model.independent(q)
    steps = np.zeros((len(own), model.nv))
    steps[np.arange(len(own)), own] = 1.0
    N = np.array([model.consistent_velocity(q, step, own) for step in steps]).T.reshape(model.nv, len(own))
    # a = N a_own + β(v_own, v_own), β(w, u) being the derivative of N u along N w: its symmetric part is in that of a by v, the rest in brackets
    symmetric = (by_v - N @ by_v[own]) / 2
    bracket = ad @ N
    velocity_by_q = symmetric + (bracket - N @ bracket[own]) / 2
    return Tangent(q, v, a, own, N, bracket / 2, velocity_by_q, by_q, by_v, by_tau[:, inputs])


def _brackets(model: Calls, v: Array) -> Array:
    """(nv, nv): v × of joints whose velocities are those of a group of turns, zero for others: δv = η̇ + v × η where η is the variation of the pose."""
    ad = np.zeros((model.nv, model.nv))
    for joint in model.joints:
        if not KINDS[joint.kind].velocity_is_rate:  # the bracket of se(3), of which such joints have a subalgebra
            own, places = slice(joint.v_index, joint.v_index + joint.nv), places_in_twist(joint.kind)
            twist = np.zeros(6)
            twist[places] = v[own]
            turn = cross(twist[3:])
            ad[own, own] = np.block([[turn, cross(twist[:3])], [np.zeros((3, 3)), turn]])[np.ix_(places, places)]
    return ad
