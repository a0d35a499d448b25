"""In which directions a joint gives way about a pose, and how stiff it is in each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ksl.mechanism.joint_kinds import KINDS
from ksl.mechanism.mechanism import Joint, Loop
from ksl.mechanism.states import Array
from ksl.mechanism.stiffness import Flexibility, steady_motion

ZERO = 1e-9
"""Lengths of directions below it, relative to those of unit size, are rounding."""


class GivingWay(NamedTuple):
    """The displacement of a joint is a combination of the columns of `directions`."""

    directions: Array
    """(6, n): displacements of the child's origin and turns about it, in the axes of the joint's frame on the child's side at the pose."""
    stiffness: Array
    """(n, n): symmetric, of the factors of the columns; zero where nothing resists."""
    along: Array
    """(n), true for columns along the joint's motion."""


def motion_at(of: Joint | Loop, first_axis: Array) -> Array:
    """The directions (6, n) of a joint's motion in the axes of its frame on the child's side.

    first_axis (3): that of a universal joint, in these axes at the pose; of other joints it is not used.
    """
    if not KINDS[of.kind].has_axis2:
        return steady_motion(of)
    return np.column_stack([np.concatenate([np.zeros(3), first_axis]), steady_motion(of)[:, 0]])


def coefficients(of: Joint | Loop, motion: Array) -> Array:
    """The rows (n, 6) that make the motion's coordinates of a displacement."""
    if KINDS[of.kind].has_pitch:  # the angle; what slides besides is the bearing
        return np.concatenate([np.zeros(3), np.array(of.axis)])[None]
    return np.linalg.pinv(motion)


def giving_way(of: Joint | Loop, motion: Array, flexibility: Flexibility | None, free: bool) -> GivingWay:
    """How a joint with a flexibility gives way.

    motion (6, n): as motion_at has it.  free: without a stiffness along its motion it moves there, and otherwise it is locked.
    """
    compliance, loose = (np.zeros((6, 6)), np.zeros((6, 0))) if flexibility is None else flexibility
    springs = _columns(compliance)
    without = _lies_in(motion, loose)
    with_spring = _lies_in(motion, springs) & ~without
    rest = _conjugate(springs, motion[:, with_spring])
    along = [motion[:, without], motion[:, with_spring]]
    stiff = np.linalg.lstsq(_unit(springs), motion[:, with_spring], rcond=None)[0] / np.linalg.norm(springs, axis=0)[:, None]
    blocks = [np.zeros((along[0].shape[1],) * 2), stiff.T @ stiff]
    missing = motion[:, ~without & ~with_spring]
    if free:
        along.append(missing)
        blocks.append(np.zeros((missing.shape[1],) * 2))
    columns = np.hstack(along)
    K = _block_diagonal([*blocks, np.eye(rest.shape[1]), np.zeros((loose.shape[1] - int(without.sum()),) * 2)])
    directions = np.hstack([columns, rest, _beside(loose, motion[:, without])])
    return GivingWay(directions, K, np.arange(directions.shape[1]) < columns.shape[1])


def _columns(compliance: Array) -> Array:
    """Columns A (6, n) with A Aᵀ = C, so that the energy of A y is ½ y·y.  Each is scaled by itself, since C has several units."""
    size = np.sqrt(np.diag(compliance))
    moves = size > 0
    scale = size[moves]
    values, vectors = np.linalg.eigh(compliance[np.ix_(moves, moves)] / np.outer(scale, scale))
    kept = values > 1e-12  # what is below is rounding of elements up to 1
    columns = np.zeros((6, int(kept.sum())))
    columns[moves] = scale[:, None] * vectors[:, kept] * np.sqrt(values[kept])
    return columns


def _unit(columns: Array) -> Array:
    length = np.linalg.norm(columns, axis=0)
    return columns / np.where(length > 0, length, 1.0)


def _lies_in(columns: Array, span: Array) -> NDArray[np.bool_]:
    """Which columns are combinations of those of a span."""
    unit = _unit(columns)
    basis = _unit(span)
    rest = unit - basis @ np.linalg.lstsq(basis, unit, rcond=ZERO)[0] if basis.shape[1] else unit
    inside: NDArray[np.bool_] = np.linalg.norm(rest, axis=0) < ZERO
    return inside


def _conjugate(springs: Array, motion: Array) -> Array:
    """Combinations of the columns of springs, of unit energy, that store no energy together with the motion."""
    if not motion.shape[1]:
        return springs
    own = np.linalg.lstsq(_unit(springs), motion, rcond=None)[0] / np.linalg.norm(springs, axis=0)[:, None]
    rest: Array = springs @ np.linalg.svd(own)[0][:, motion.shape[1] :]
    return rest


def _beside(loose: Array, motion: Array) -> Array:
    """Combinations of orthonormal columns at right angles to those of the motion."""
    rest: Array = loose @ np.linalg.svd(loose.T @ motion)[0][:, motion.shape[1] :]
    return rest


def _block_diagonal(blocks: list[Array]) -> Array:
    n = sum(len(block) for block in blocks)
    out, k = np.zeros((n, n)), 0
    for block in blocks:
        out[k : k + len(block), k : k + len(block)] = block
        k += len(block)
    return out
