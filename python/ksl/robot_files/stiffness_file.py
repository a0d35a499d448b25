"""Stiffnesses of joints in a TOML file: a table for each joint, `[A]` with `axial` and `radial`, N/m, `tilting` and `motion`, N m/rad; or `A = [six numbers]`, or `A = one`."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from ksl.base.errors import DescriptionError
from ksl.base.files_read import being_read
from ksl.base.toml_files import read_toml
from ksl.model.model import Model
from ksl.mechanism.stiffness import Stiffness, joints_of_loops


def stiffnesses(given: str | os.PathLike[str]) -> dict[str, Stiffness]:
    """The stiffnesses of a file, {joint: as calls take them}.  Raises DescriptionError, which begins with the name of the file."""
    file = os.fspath(given)
    with being_read("stiffness", file, DescriptionError):
        table: dict[str, Any] = read_toml(file, DescriptionError, "stiffnesses: a table [JOINT] for each, with axial, radial, tilting and motion")
    if not table:
        raise DescriptionError(f"{file}: no joint in it; write a table [JOINT] for each joint that gives way, or leave the file out")
    return table


@contextmanager
def in_file(given: str | os.PathLike[str]) -> Iterator[None]:
    """Says of errors about stiffnesses which file they are in."""
    try:
        yield
    except ValueError as e:
        raise DescriptionError(f"{os.fspath(given)}: {e}") from None


def stiff_by(model: Model, given: str | os.PathLike[str] | Mapping[str, Stiffness]) -> tuple[Model, list[str]]:
    """The model with the stiffnesses of a file, or with these; and what to say of joints of its loops that are left out.

    Raises ValueError, which begins with the name of the file.
    """
    if isinstance(given, Mapping):
        return _stiff(model, given, "the stiffnesses")
    table = stiffnesses(given)
    with in_file(given):
        return _stiff(model, table, os.fspath(given))


def _stiff(model: Model, given: Mapping[str, Stiffness], name: str) -> tuple[Model, list[str]]:
    if not model.loops:
        raise ValueError(f"{model.name} has no loops, so that no result depends on stiffnesses; leave them out")
    stiff = model.with_stiffness(given)
    rigid = joints_without(model, given) if given else []
    return stiff, [f"{', '.join(rigid)}: not in {name}, and therefore rigid; they take what the other joints of the loops would share"] if rigid else []


def joints_without(model: Model, given: Iterable[str]) -> list[str]:
    """The joints of the loops that are not among those given."""
    known = set(given)
    return [name for name in joints_of_loops(model) if known.isdisjoint((name, f"joint:{name}"))]
