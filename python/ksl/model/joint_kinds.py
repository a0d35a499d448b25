"""The kinds of joints.  All that Python says of a kind is taken from its row in the compiled module, where a kind is one struct."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from ksl._core import JointKind, joint_kinds

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


def has_one_coordinate(kind: str) -> bool:
    """Whether a joint of that kind has one coordinate; false for words that name no kind."""
    return kind in KINDS and KINDS[kind].nv == 1
