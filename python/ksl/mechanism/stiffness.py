"""Stiffnesses of joints, as compliances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ksl.mechanism import given
from ksl.mechanism.requests import one_of

if TYPE_CHECKING:
    from ksl.mechanism.mechanism import Loop, Mechanism

Stiffness = ArrayLike | Mapping[str, float]
"""Six numbers, a (6, 6) matrix, or a mapping with "axial", "radial" and "tilting"."""


def joints_of_loops(model: Mechanism) -> list[str]:
    """The joints whose stiffnesses count: those of the loops, from either end to where their ways to the ground meet, and those that close them."""
    names: dict[str, None] = {}
    for loop in model.loops:
        one, other = ways_of(model, loop)
        names.update(dict.fromkeys((*one, *other, loop.name)))
    return list(names)


_COMPLIANCES = 8
"""Where they stand in the state of a description: python/description_state.hpp."""


def compliances_of(model: Mechanism) -> dict[str, list[float]]:
    """{joint: compliance (36), row by row} of the joints that give way."""
    return {joint: list(matrix) for joint, matrix in model._core.state()[_COMPLIANCES]} if model.loops else {}


def rigid_beside(model: Mechanism) -> list[str]:
    """The joints of the loops that have no stiffness, where others have one: they take what all would share."""
    stiff = compliances_of(model)
    return [name for name in joints_of_loops(model) if name not in stiff] if stiff else []


def ways_of(model: Mechanism, loop: Loop) -> tuple[list[str], list[str]]:
    """The joints of the tree from both ends of a loop joint, predecessor first, to where the ways to the ground meet."""
    one, other = (model.support(link) for link in (loop.predecessor, loop.successor))
    return [joint for joint in one if joint not in other], [joint for joint in other if joint not in one]


def compliance_of(joint: str, stiffness: Stiffness, axis: Sequence[float] | None) -> list[float]:
    """The compliance (36), row by row, of a joint's stiffness."""
    who = f"stiffness of joint {joint}"
    if isinstance(stiffness, Mapping):
        return _of_bearing(who, stiffness, axis)
    numbers = given.numbers(stiffness, who)
    if numbers.shape == (6,):
        return [float(x) for x in np.diag(_inverse(numbers, who)).ravel()]
    matrix = given.array(numbers, (6, 6), f"{who}, six numbers or (6, 6)")
    if not np.isfinite(matrix).all() or np.abs(matrix - matrix.T).max() > 1e-9 * np.abs(matrix).max() or not (np.linalg.eigvalsh(matrix) > 0).all():
        raise ValueError(f"{who}: the matrix is not finite, symmetric and positive definite; correct it, or give six numbers")
    inverse = np.linalg.inv(matrix)
    return [float(x) for x in ((inverse + inverse.T) / 2).ravel()]


def _inverse(numbers: np.ndarray, who: str) -> np.ndarray:
    """1 / stiffness, 0 for infinite ones."""
    if not (numbers > 0).all():  # NaN is not, either
        raise ValueError(f"{who}: found {numbers.tolist()}; every stiffness is positive, or inf where the joint is rigid")
    return np.asarray(1.0 / numbers)


def _of_bearing(who: str, stiffness: Mapping[str, float], axis: Sequence[float] | None) -> list[float]:
    for key in stiffness:
        one_of(key, f"{who} has key", "axial", "radial", "tilting")
    if axis is None or not any(axis):
        raise ValueError(f"{who}: the joint has no axis, or there is no such joint; give six numbers in the axes of its frame")
    u = np.array(axis)
    along, across = np.outer(u, u), np.eye(3) - np.outer(u, u)
    axial, radial, tilting = _inverse(np.array([given.number(stiffness.get(key, np.inf), f"{who}: {key}") for key in ("axial", "radial", "tilting")]), who)
    C = np.zeros((6, 6))
    C[:3, :3] = axial * along + radial * across
    C[3:, 3:] = tilting * across
    return [float(x) for x in C.ravel()]
