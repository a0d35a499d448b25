"""Natural frequencies and shapes about a pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ksl.mechanism import given
from ksl.base.finite_results import require_finite
from ksl.mechanism.calls import Calls
from ksl.mechanism.loops import one_position
from ksl.mechanism.states import Array
from ksl.mechanism.stiffness import Stiffnesses, table_of
from ksl.model.poses_at_rest import Modes
from ksl.small_motions.directions import cross
from ksl.small_motions.elastic import Elastic, elastic, factors_of, falls, flexibilities

ROUNDING = 64 * np.finfo(float).eps
"""Squares of frequencies below it, times their number and the largest, are zero."""

NO_MASS = 1e-13
"""Masses below it, relative to the terms that they are made of, are rounding."""


@np.errstate(over="ignore", invalid="ignore")  # what is not finite is an error at the end
def modes(model: Calls, q: ArrayLike, stiffness: Stiffnesses | None = None, gravity: bool = True) -> Modes:
    """See :meth:`ksl.Model.modes`."""
    at, weight = one_position(model, q), given.flag(gravity, "gravity") and bool(model.gravity.any())
    flexible = flexibilities(model, table_of(model, stiffness), at if weight else None)
    if weight and (name := falls(model, flexible)):
        raise ValueError(f"{name} holds nothing, so that no pose is at rest under weight: gravity=False, a stiffness of {name}, or with_frozen_joints")
    body = elastic(model, at, flexible)
    N, (mass, terms) = body.closed, body.mass
    K, M = N.T @ body.stiffness(model.gravity if weight else np.zeros(3)) @ N, N.T @ mass @ N
    carries = np.diag(M) > NO_MASS * np.einsum("ai,ab,bi->i", np.abs(N), terms, np.abs(N))
    M = M * np.outer(carries, carries)
    for what, x in (("stiffness", K), ("mass", M)):
        require_finite("modes", what, x)
    squares, shapes = _solved(K, M, body, N)
    frequencies = np.sign(squares) * np.sqrt(np.abs(squares)) / (2 * np.pi)
    twists = body.to.twists @ (body.to.factors @ shapes)  # (links, 6, n)
    participation = np.einsum("lin,lij,ljk->nk", twists, body.inertia, _of_the_ground(body)) if shapes.shape[1] else np.zeros((0, 6))
    names, strain = _strain(body, shapes)
    zero = tuple(body.names(shapes[:, k]) for k in np.flatnonzero(squares == 0))
    return Modes(frequencies, twists.transpose(2, 0, 1), participation, participation**2, strain, names, tuple(model.link_names), zero)


def _solved(K: Array, M: Array, body: Elastic, N: Array) -> tuple[Array, Array]:
    """Squares of angular frequencies, rising, and shapes (n, modes) of unit modal mass.  What has no mass follows the rest without inertia."""
    size = np.sqrt(np.where(np.diag(M) > 0, np.diag(M), np.abs(np.diag(K))))
    scale = 1 / np.where(size > 0, size, 1.0)
    K, M = K * np.outer(scale, scale), M * np.outer(scale, scale)
    values, V = np.linalg.eigh(M)
    massive = values > NO_MASS * max(1.0, values.max(initial=0.0))
    Z, R = V[:, ~massive], V[:, massive]
    if Z.shape[1]:
        kzz = Z.T @ K @ Z
        weak, W = np.linalg.eigh(kzz)
        if (np.abs(weak) < 1e-12 * np.abs(weak).max()).any() or not weak.any():
            names = body.names(N @ (scale * (Z @ W[:, np.argmin(np.abs(weak))])))
            raise ValueError(f"{', '.join(names)}: nothing resists a motion that moves no mass, which has no frequency; give it a stiffness, or leave it rigid")
        R = R - Z @ np.linalg.solve(kzz, Z.T @ K @ R)
    k, m = R.T @ K @ R, R.T @ M @ R
    inverse = np.linalg.inv(np.linalg.cholesky((m + m.T) / 2)) if len(m) else m
    a = inverse @ k @ inverse.T
    squares, x = np.linalg.eigh((a + a.T) / 2)
    squares[np.abs(squares) <= ROUNDING * len(squares) * np.abs(squares).max(initial=0.0)] = 0.0
    return squares, N @ (scale[:, None] * (R @ inverse.T @ x))


def _of_the_ground(body: Elastic) -> Array:
    """(links, 6, 6): twists of the links, at their origins in their axes, where the ground moves along and about the world's axes."""
    out = np.zeros((len(body.to.pose), 6, 6))
    for T, pose in zip(out, body.to.pose):
        R, p = pose[:3, :3], pose[:3, 3]
        T[:3, :3], T[3:, 3:], T[:3, 3:] = R.T, R.T, -R.T @ cross(p)
    return out


def _strain(body: Elastic, shapes: Array) -> tuple[tuple[str, ...], Array]:
    """Names of joints with springs, and their shares (modes, joints) in the energy of these."""
    names, energies = [], []
    for i, joint in enumerate(body.model.joints):
        own = np.flatnonzero(body.to.owner == i)
        K, spring = body.to.own_stiffness[np.ix_(own, own)], body.to.springs.get(joint.name, np.zeros((1, len(shapes))))
        if K.any() or spring.any():
            names.append(joint.name)
            energies.append(np.einsum("an,ab,bn->n", shapes[own], K, shapes[own]) + (spring @ shapes)[0] ** 2)
    for loop in body.loops:
        if loop.way.stiffness.any():
            x = factors_of(loop) @ body.to.factors @ shapes
            names.append(loop.name)
            energies.append(np.einsum("an,ab,bn->n", x, loop.way.stiffness, x))
    energy = np.array(energies).reshape(len(names), shapes.shape[1]).T
    total = energy.sum(axis=1, keepdims=True)
    return tuple(names), np.divide(energy, total, out=np.zeros_like(energy), where=total > 0) + 0.0
