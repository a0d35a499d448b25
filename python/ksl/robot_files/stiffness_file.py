"""Stiffnesses of joints in a TOML file: a table for each joint, `[A]` with `axial` and `radial`, N/m, `tilting` and `motion`, N m/rad; or `A = [six numbers]`, or `A = one`.

Or a file of components, of which some say how they give way.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any

from ksl.base.errors import DescriptionError
from ksl.base.files_read import being_read
from ksl.base.higher_rooms import function_of
from ksl.base.input_files import path_given
from ksl.base.toml_files import read_toml
from ksl.model.model import Model
from ksl.mechanism.stiffness import BEARING_KEYS, Stiffness, joints_of_loops, table_of


def stiffnesses(given: str | os.PathLike[str]) -> dict[str, Stiffness]:
    """The stiffnesses of a file, {joint: as calls take them}.  Raises ValueError, which begins with the name of the file."""
    file = path_given(given, "a file of stiffnesses", "stiffness")
    with being_read("stiffness", file, DescriptionError):
        table: dict[str, Any] = read_toml(file, DescriptionError, "stiffnesses: a table [JOINT] for each, with axial, radial, tilting, torsional and motion")
    if _has_components(table):
        of_components: dict[str, Stiffness] = function_of("component_stiffnesses")(file)
        return of_components
    if not table:
        raise DescriptionError(f"{file}: no joint in it; write a table [JOINT] for each joint that gives way, or leave the file out")
    return table


def _has_components(table: Mapping[str, Any]) -> bool:
    """Whether it is a components file: with a list of tables [[component]], or tables [stiffness.JOINT], which no joint has."""
    entries, inner = table.get("component"), table.get("stiffness")
    nested = isinstance(inner, Mapping) and not inner.keys() & set(BEARING_KEYS)
    return nested or (isinstance(entries, list) and any(isinstance(x, Mapping) for x in entries))


def stiff_by(model: Model, given: str | os.PathLike[str] | Mapping[str, Stiffness]) -> tuple[Model, list[str]]:
    """The model with the stiffnesses of a file, or with these; and what to say of joints of its loops that are left out.

    Raises ValueError, which begins with the name of the file.
    """
    if not model.loops:
        raise ValueError(f"{model.name} has no loops, so that no result depends on stiffnesses; leave them out")
    if isinstance(given, Mapping):
        return _stiff(model, given, "the stiffnesses")
    return _stiff(model, table_of(model, given), os.fspath(given))


def _stiff(model: Model, given: Mapping[str, Stiffness], name: str) -> tuple[Model, list[str]]:
    stiff = model.with_stiffness(given)
    rigid = joints_without(model, given) if given else []
    return stiff, [f"{', '.join(rigid)}: not in {name}, and therefore rigid; they take what the other joints of the loops would share"] if rigid else []


def joints_without(model: Model, given: Iterable[str]) -> list[str]:
    """The joints of the loops that are not among those given."""
    known = set(given)
    return [name for name in joints_of_loops(model) if known.isdisjoint((name, f"joint:{name}"))]
