"""Stiffnesses of joints, as compliances."""

from __future__ import annotations

import os
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, overload

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.errors import DescriptionError, unknown_name
from ksl.base.higher_rooms import function_of
from ksl.mechanism import given
from ksl.mechanism.gear_classes import Of, along_motion
from ksl.mechanism.joint_kinds import KINDS, own_axes, places_in_twist
from ksl.mechanism.requests import one_of

if TYPE_CHECKING:
    from ksl.mechanism.mechanism import Joint, Loop, Mechanism

Stiffness = ArrayLike | Mapping[str, Any]
"""One number, along the joint's motion; six numbers; a (6, 6) matrix; or a mapping with some of "axial", "radial", "tilting", "torsional" and "motion", the last
a number or classes as :mod:`ksl.mechanism.gear_classes` has them, and where they act: "position" along the joint's axis, or "axis" and "at" of a joint without one."""
Stiffnesses = Mapping[str, Stiffness] | str | os.PathLike[str]
"""{joint: …}, or a TOML file: of stiffnesses, or of components that have some."""
BEARING_KEYS = ("axial", "radial", "tilting", "torsional", "motion", "position", "axis", "at")


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
    """{joint: compliance (36), row by row} of the joints that give way, where reactions depend on it.

    Where nothing resists in some directions, 36 numbers more: Σ u uᵀ over these.
    """
    kept = model._core.state()[_COMPLIANCES] if model.loops else []
    return {joint: [*matrix, *(loose if any(loose) else ())] for joint, matrix, loose in kept if joint}  # no loop goes through the ground's joint


def all_flexibilities_of(model: Mechanism) -> dict[str, Flexibility]:
    """How all joints give way that have stiffnesses in the model."""
    kept = model._core.state()[_COMPLIANCES]
    return {joint or ground_of(model): Flexibility(np.reshape(matrix, (6, 6)), _independent(np.reshape(loose, (6, 6)))) for joint, matrix, loose in kept}


def ground_of(model: Mechanism) -> str:
    """The name of the joint that fixes the root to the ground, whose stiffness a description keeps without a name; empty where the root floats."""
    return next((joint.name for joint in model.joints if joint.parent is None and joint.kind == "fixed"), "")


def rigid_beside(model: Mechanism) -> list[str]:
    """The joints of the loops that have no stiffness, where others have one: they take what all would share."""
    stiff = compliances_of(model)
    return [name for name in joints_of_loops(model) if name not in stiff] if stiff else []


def ways_of(model: Mechanism, loop: Loop) -> tuple[list[str], list[str]]:
    """The joints of the tree from both ends of a loop joint, predecessor first, to where the ways to the ground meet."""
    one, other = (model.support(link) for link in (loop.predecessor, loop.successor))
    return [joint for joint in one if joint not in other], [joint for joint in other if joint not in one]


FARTHEST = 10.0
"""m: what acts farther from a joint is no bearing or flange of it."""
DIRECTIONS = {"axial": "along the axis", "radial": "across the axis", "tilting": "about lines across the axis", "torsional": "about the axis"}
"""Keys of stiffnesses, and in which directions they are."""
PLACES = ("position", "axis", "at")
"""Keys that say where stiffnesses act."""


class Flexibility(NamedTuple):
    """How a joint gives way, as displacements of its child's origin and turns about it, in the axes of its frame on the child's side."""

    compliance: np.ndarray
    """(6, 6), m/N … rad/(N m), linear first."""
    loose: np.ndarray
    """(6, directions) in which it gives way without resisting: those of zero stiffness."""

    def numbers(self) -> tuple[list[float], list[float]]:
        """The compliance (36), row by row, and Σ u uᵀ over the loose directions, as a description has them."""
        return self.compliance.ravel().tolist(), (self.loose @ self.loose.T).ravel().tolist()


@overload
def table_of(model: Mechanism, stiffness: Stiffnesses) -> Mapping[str, Stiffness]: ...
@overload
def table_of(model: Mechanism, stiffness: Stiffnesses | None) -> Mapping[str, Stiffness] | None: ...
def table_of(model: Mechanism, stiffness: Stiffnesses | None) -> Mapping[str, Stiffness] | None:
    """{joint: …} as it is given, or of a file, judged.  Raises ValueError, which begins with the name of the file."""
    if not isinstance(stiffness, (str, os.PathLike)):
        return stiffness
    table: Mapping[str, Stiffness] = function_of("stiffnesses")(stiffness)
    try:
        flexibilities_of(model, table)
    except ValueError as e:
        raise DescriptionError(f"{os.fspath(stiffness)}: {e}") from None
    return table


def flexibilities_of(
    model: Mechanism, stiffness: Mapping[str, Stiffness], efforts: Mapping[str, float] = MappingProxyType({}), of: Of = "slope"
) -> dict[str, Flexibility]:
    """How the joints that are named give way.  Raises ValueError that names the joint.

    efforts, of: at which efforts along their motions stiffnesses in classes are meant, zero by default, and which of their stiffnesses.
    """
    joints: dict[str, Joint | Loop] = {joint.name: joint for joint in model.joints}
    joints |= {loop.name: loop for loop in model.loops}
    found: dict[str, Flexibility] = {}
    for name, x in given.mapping(
        stiffness, "stiffness", "{joint: a number, six, a (6, 6) matrix, or axial, radial, tilting, torsional and motion}, or a TOML file"
    ):
        joint = model._plain(given.name(name, "a joint"), "joint")
        if joint not in joints:
            raise DescriptionError(unknown_name(model.name or model.file, "joint", joint, list(joints)))
        if joint in found:
            raise ValueError(f"stiffness of joint {joint}: it is given twice; give it once")
        found[joint] = flexibility_of(joints[joint], x, efforts.get(joint, 0.0), of)
    return found


def flexibility_of(joint: Joint | Loop, stiffness: Stiffness, effort: float = 0.0, of: Of = "slope") -> Flexibility:
    """How a joint with this stiffness gives way at an effort along its motion.  Raises ValueError that names it."""
    who = f"stiffness of joint {joint.name}"
    if isinstance(stiffness, Mapping):
        motion = {"motion": along_motion(who, stiffness["motion"], effort, of)} if "motion" in stiffness else {}
        return _of_bearing(who, {**stiffness, **motion}, joint)
    numbers = given.numbers(stiffness, who)
    if numbers.shape == ():
        return _of_bearing(who, {"motion": float(numbers)}, joint)
    if numbers.shape == (6,):
        return _of_directions(who, np.eye(6), numbers)
    matrix = given.array(numbers, (6, 6), f"{who}, one number, six, or (6, 6)")
    if not np.isfinite(matrix).all() or np.abs(matrix - matrix.T).max() > 1e-9 * np.abs(matrix).max() or not (np.linalg.eigvalsh(matrix) > 0).all():
        raise ValueError(f"{who}: the matrix is not finite, symmetric and positive definite; correct it, or give six numbers")
    inverse = np.linalg.inv(matrix)
    return Flexibility((inverse + inverse.T) / 2, np.zeros((6, 0)))


def _of_directions(who: str, directions: np.ndarray, stiffnesses: ArrayLike) -> Flexibility:
    """What stiffnesses make along columns that are orthogonal to each other: N/m, N m/rad; inf where it is rigid."""
    k = np.asarray(stiffnesses, dtype=float)
    if not (k >= 0).all():  # NaN is not, either
        raise ValueError(f"{who}: found {k.tolist()}; every stiffness is positive, 0 where nothing resists, or inf where the joint is rigid")
    resists = k > 0
    springs = directions[:, resists]
    return Flexibility(springs @ np.diag(1 / k[resists]) @ springs.T, directions[:, ~resists])


def _of_bearing(who: str, stiffness: Mapping[str, Any], of: Joint | Loop) -> Flexibility:
    for key in stiffness:
        one_of(key, f"{who} has key", *BEARING_KEYS)
    u, at = _place(who, stiffness, of)
    across = np.linalg.svd(u[None])[2][1:]
    keys = ["axial", "radial", "radial", "tilting", "tilting", "torsional"]
    directions = np.zeros((6, 6))
    directions[:3, 0], directions[:3, 1:3], directions[3:, 3:5], directions[3:, 5] = u, across.T, across.T, u
    motion = steady_motion(of)
    if "motion" in stiffness and motion.shape[1] != 1:
        raise ValueError(f"{who}: a {of.kind} joint has no single motion; give six numbers in the axes of its frame")
    for key in DIRECTIONS.keys() & stiffness.keys():
        own = directions[:, [k == key for k in keys]]
        if np.allclose(motion @ (motion.T @ own), own) or (key == "torsional" and KINDS[of.kind].has_pitch):
            moves = "slides" if own[:3].any() else "turns"
            mend = "give motion" if motion.shape[1] == 1 else "leave it out"
            raise ValueError(f"{who}: {key} is {DIRECTIONS[key]}, and a {of.kind} joint {moves} there; {mend}")
    numbers = {key: given.number(x, f"{who}: {key}") for key, x in stiffness.items() if key not in PLACES}
    bearing = _moved(_of_directions(who, directions, [numbers.get(key, np.inf) for key in keys]), at)
    if not KINDS[of.kind].has_pitch:  # whose motion is none of these directions
        bearing = Flexibility(_without(bearing.compliance, motion), _independent(bearing.loose - motion @ (motion.T @ bearing.loose)))
    along = _of_directions(who, motion, [numbers["motion"]]) if "motion" in stiffness else Flexibility(np.zeros((6, 6)), np.zeros((6, 0)))
    return Flexibility(bearing.compliance + along.compliance, np.hstack([bearing.loose, along.loose]))


def _place(who: str, stiffness: Mapping[str, Any], of: Joint | Loop) -> tuple[np.ndarray, np.ndarray]:
    """The unit vector (3) that axial and tilting refer to, and the point (3) about which the joint tilts, in its frame."""
    if of.axis is not None and any(of.axis):
        for key in ("axis", "at"):
            if key in stiffness:
                raise ValueError(f"{who}: {key} is for joints without an axis, and {of.name} has one; give position, m along it from the joint's origin")
        u = np.array(of.axis)
        return u, _near(who, given.number(stiffness.get("position", 0.0), f"{who}: position") * u)
    if "position" in stiffness or "axis" not in stiffness:
        raise ValueError(
            f"{who}: the joint has no axis; give axis = [x, y, z] beside axial, radial, tilting and torsional, and at = [x, y, z] where it tilts; or six numbers in the axes of its frame"
        )
    u, at = (given.array(stiffness.get(key, [0.0, 0.0, 0.0]), (3,), f"{who}: {key}") for key in ("axis", "at"))
    length = np.linalg.norm(u)
    if not (np.isfinite(length) and length > 0 and np.isfinite(at).all()):
        raise ValueError(f"{who}: axis {u.tolist()} and at {at.tolist()}; expected a direction and a point, m")
    return u / length, _near(who, at)


def _near(who: str, at: np.ndarray) -> np.ndarray:
    """Refuses a point that was most likely meant in millimetres."""
    if not (far := float(np.linalg.norm(at))) < FARTHEST:
        raise ValueError(f"{who}: it acts {far:g} m from the joint's origin; lengths are in metres: {far:g} mm are {far / 1000:g}")
    return at


def _moved(of: Flexibility, at: np.ndarray) -> Flexibility:
    """What gives way about a point, as displacements of the origin: d = d_at + at × rotation."""
    x, y, z = at
    X = np.eye(6)
    X[:3, 3:] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    return Flexibility(X @ of.compliance @ X.T, X @ of.loose)


def _without(compliance: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """What is left of a compliance where orthonormal directions of motion are no part of it."""
    rest: np.ndarray = np.eye(6) - motion @ motion.T
    return np.asarray(rest @ compliance @ rest)


def _independent(directions: np.ndarray) -> np.ndarray:
    """Orthonormal columns that span the same."""
    basis, size, _ = np.linalg.svd(directions, full_matrices=False)
    return np.asarray(basis[:, size > 1e-9 * size.max(initial=1.0)])


def steady_motion(of: Joint | Loop) -> np.ndarray:
    """The directions (6, n) of a joint's motion that stay in the axes of its frame on the child's side.  The other one, of a universal joint, turns with it."""
    kind = KINDS[of.kind]
    if kind.has_axis2:
        return np.concatenate([np.zeros(3), of.axis2 or np.zeros(3)])[:, None]
    axes, places = own_axes(of.kind, of.axis), sorted(places_in_twist(of.kind))
    motion = np.zeros((6, len(places)))
    for column, place in enumerate(places):
        at = place // 3 * 3
        motion[at : at + 3, column] = axes[place % 3]
    if kind.has_pitch:
        motion[:3, 0] = of.pitch * axes[2]
    return motion
