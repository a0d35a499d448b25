"""How far numbers of two libraries are apart."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ksl.comparison.coordinates import Array
from ksl.comparison.other_robot import Numbers
from ksl.comparison.results import Quantity
from ksl.mechanism.joint_kinds import KINDS
from ksl.model.model import Model

TOLERANCE = 1e-8
"""Numbers agree where they differ by less than this share of the largest of their kind.  Double precision leaves some 1e-12 of accelerations of light
links on heavy ones; MuJoCo's compiler keeps tensors as principal moments and a quaternion, to 1e-14.  What another rule of files makes of a robot is
larger by orders of magnitude."""

ROUNDINGS = 8
"""Between two stable solutions of the same linear equations."""

EFFORTS, ACCELERATIONS, MASS_MATRIX = "inverse dynamics", "forward dynamics", "mass matrix"
POSITIONS, ORIENTATIONS, JACOBIANS = "positions", "orientations", "Jacobians"
DYNAMIC = (EFFORTS, ACCELERATIONS, MASS_MATRIX)


class Pair(NamedTuple):
    """One quantity in both libraries: arrays of one shape, states first."""

    name: str
    ksl: Array
    other: Array
    scale: Array | float
    """What differences are shares of; it broadcasts to the arrays."""
    units: list[str]
    places: list[str]
    """Unit, and joint or link, of each number along the axis behind that of states."""


def largest(x: Array) -> float:
    """The largest magnitude; 0 of nothing."""
    return float(np.abs(x).max(initial=0.0))


def close(other: Array, ksl: Array, scale: Array | float) -> bool:
    return largest((other - ksl) / scale) <= TOLERANCE


def scale_of_coordinates(model: Model, x: Array) -> Array:
    """The largest number of each unit, (nv): newtons and newton metres, m/s² and rad/s² are not compared."""
    angular = _angular(model)
    scale = np.ones(model.nv)
    for kind in (angular, ~angular):
        scale[kind] = largest(x[:, kind]) or 1.0
    return scale


def rounding_of_accelerations(ksl: Numbers) -> Array:
    """What rounding leaves open of accelerations, (n, nv): two libraries that solve M a = b stably are apart by |M⁻¹| |M| |a| times a few roundings."""
    if ksl.accelerations is None:
        return np.zeros_like(ksl.efforts)
    try:
        inverse = np.linalg.inv(ksl.mass_matrix)
    except np.linalg.LinAlgError:
        return np.zeros_like(ksl.efforts)
    moved = np.abs(ksl.mass_matrix) @ np.abs(ksl.accelerations)[..., None]
    return np.asarray(ROUNDINGS * np.finfo(float).eps * (np.abs(inverse) @ moved)[..., 0])


def scale_of_matrix(M: Array) -> Array:
    """√(Mii Mjj) of the largest of the states, (nv, nv): its numbers have units of their own."""
    d = np.sqrt(np.abs(np.einsum("nii->ni", M)).max(axis=0, initial=0.0))
    d[d == 0.0] = 1.0
    return np.asarray(np.outer(d, d))


def pairs(model: Model, ksl: Numbers, other: Numbers) -> Iterator[Pair]:
    """All quantities that both have."""
    joints = [name for name in model.joint_names for _ in range(model.joint(name).nv)]
    angular = _angular(model)
    yield Pair(EFFORTS, ksl.efforts, other.efforts, scale_of_coordinates(model, ksl.efforts), ["N m" if a else "N" for a in angular], joints)
    if ksl.accelerations is not None and other.accelerations is not None:
        scale = np.maximum(scale_of_coordinates(model, ksl.accelerations), rounding_of_accelerations(ksl) / TOLERANCE)
        yield Pair(ACCELERATIONS, ksl.accelerations, other.accelerations, scale, ["rad/s²" if a else "m/s²" for a in angular], joints)
    yield Pair(MASS_MATRIX, ksl.mass_matrix, other.mass_matrix, scale_of_matrix(ksl.mass_matrix), ["kg m²" if a else "kg" for a in angular], joints)
    links = list(ksl.poses)
    if not links:
        return
    ours, theirs = (np.stack([x.poses[link] for link in links], axis=1) for x in (ksl, other))
    reach = largest(ours[..., :3, 3]) or 1.0
    yield Pair(POSITIONS, ours[..., :3, 3], theirs[..., :3, 3], reach, ["m"] * len(links), links)
    yield Pair(ORIENTATIONS, ours[..., :3, :3], theirs[..., :3, :3], 1.0, ["rad"] * len(links), links)
    ours, theirs = (np.stack([x.jacobians[link] for link in links], axis=1) for x in (ksl, other))
    yield Pair(JACOBIANS, ours, theirs, largest(ours) or 1.0, ["m or rad"] * len(links), links)


def quantity(pair: Pair) -> Quantity:
    """What a person reads of a pair."""
    gap = np.abs(pair.other - pair.ksl)
    share = np.broadcast_to(gap / pair.scale, gap.shape)
    if not share.any():
        return Quantity(pair.name, 0.0, 0.0, True, pair.units[0] if pair.units else "", "")
    worst = np.unravel_index(int(np.nanargmax(np.where(np.isnan(share), np.inf, share))), share.shape)
    k = int(worst[1])
    relative = float(share[worst])
    return Quantity(pair.name, float(gap[worst]), relative, relative <= TOLERANCE, pair.units[k], f"{pair.places[k]}, state {int(worst[0])}")


def _angular(model: Model) -> NDArray[np.bool_]:
    """Whether each coordinate of velocity is an angle's."""
    units = [unit for name in model.joint_names for unit in KINDS[model.joint(name).kind].velocity_unit]
    return np.array([unit == "rad" for unit in units], dtype=bool)
