"""The kinds of joints, and names and units of a motion's columns.  All that Python says of a kind is taken from its row in the compiled module, where a kind is one struct."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ksl._core import JointKind, joint_kinds
from ksl.mechanism.joint_columns import endings_of
from ksl.mechanism.states import Array

Kind = Literal["fixed", "revolute", "continuous", "prismatic", "helical", "cylindrical", "universal", "spherical", "planar", "translation", "floating"]
"""The names of the kinds, for type checkers and editors."""
AnyKind = Kind | Literal["screw", "ball", "free"]
"""With the second names that files and programs may give them."""

KINDS: dict[str, JointKind] = {kind.name: kind for kind in joint_kinds}
"""By their names."""
ANY_NAME: dict[str, JointKind] = KINDS | {kind.other_name: kind for kind in joint_kinds if kind.other_name is not None}
"""By their names, and by the second names that files may give them: "screw", "ball", "free"."""


def names_with(wanted: Callable[[JointKind], bool]) -> frozenset[str]:
    """All names of the kinds that have a property."""
    return frozenset(name for name, kind in ANY_NAME.items() if wanted(kind))


def turns(kind: str) -> int:
    """About how many directions a joint of the kind turns: 0 to 3."""
    return KINDS[kind].velocity_unit.count("rad")


def slides(kind: str) -> int:
    """Along how many directions it slides, whatever it turns by: 0 to 3."""
    return KINDS[kind].velocity_unit.count("m")


def places_in_twist(kind: str) -> list[int]:
    """Where the numbers of a kind's velocity are in a twist, linear first, in its frame, whose z is its axis if it has one: 0 to 5 each.

    The last letter of a number's name says so, `vx`, `wz`; one without such a letter is along or about z.  Not for universal joints, whose axes are not those of one frame.
    """
    of = KINDS[kind]
    return [("xyz".index(name[-1]) if name[-1] in "xyz" else 2) + 3 * (unit == "rad") for name, unit in zip(of.velocity, of.velocity_unit, strict=True)]


def own_axes(kind: str, axis: ArrayLike | None) -> Array:
    """The axes x, y, z (3, 3), by rows, of the frame that :func:`places_in_twist` is about: z is the joint's axis; those of the description if it has none."""
    if not KINDS[kind].has_axis or axis is None:
        return np.eye(3)
    u = np.array(axis, dtype=float)[None]
    return np.concatenate([np.linalg.svd(u)[2][1:], u])


def has_one_coordinate(kind: str) -> bool:
    """Whether a joint of that kind has one coordinate; false for words that name no kind."""
    return kind in KINDS and KINDS[kind].nv == 1


class OfKind(Protocol):
    """A joint, as far as its columns need it."""

    @property
    def name(self) -> str: ...
    @property
    def kind(self) -> str: ...


_ENDINGS = {name: endings_of(kind)[:3] for name, kind in KINDS.items()}
_UNITS = {name: (kind.position_unit, kind.velocity_unit, kind.velocity_unit) for name, kind in KINDS.items()}


def columns_of(joint: OfKind) -> tuple[list[str], list[str], list[str]]:
    """Names of a joint's columns: positions, velocities, accelerations."""
    return _named(joint.name, joint.kind)


def units_of(joint: OfKind) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Units of the numbers in these columns, "m" or "rad" without the time in rates; "" for those of a quaternion."""
    return _UNITS[joint.kind]


def columns_of_one_coordinate(joint: OfKind) -> tuple[list[str], list[str], list[str]]:
    """The columns that it would have if it had one coordinate."""
    return _named(joint.name, "revolute")


def _named(joint: str, kind: str) -> tuple[list[str], list[str], list[str]]:
    position, velocity, acceleration = ([joint + ending for ending in group] for group in _ENDINGS[kind])
    return position, velocity, acceleration
