"""`--stiffness FILE.toml`: stiffnesses of the joints of a closed mechanism."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ksl.commands.app import errors, fail

if TYPE_CHECKING:
    from ksl.base.files_read import InputFile
    from ksl.model.model import Model

Stiffness = Annotated[Path | None, typer.Option("--stiffness", metavar="FILE.toml", help="Stiffnesses of joints, which decide what rigid bodies leave open in a robot with loops.")]


def with_stiffness(model: Model, file: Path | None) -> tuple[Model, list[InputFile]]:
    """The model with the stiffnesses of a file, and the files that were read; fails where they can't be used.

    The file has a table for each joint: `[A]` with `axial` and `radial`, N/m, and `tilting`, N m/rad; or `A = [six numbers]`.
    """
    if file is None:
        return model, []
    from ksl.base.errors import DescriptionError
    from ksl.base.files_read import being_read, recorded
    from ksl.base.toml_files import read_toml

    if not model.loops:
        fail(f"--stiffness {file}: {model.name} has no loops, so that no result depends on stiffnesses; leave it out")
    try:
        with recorded() as ledger, being_read("stiffness", file, DescriptionError):
            given: dict[str, Any] = read_toml(file, DescriptionError, "stiffnesses: a table [JOINT] for each, with axial, radial and tilting")
        stiff = model.with_stiffness(given)
        rigid = joints_without(model, given)
        if rigid:
            errors.print(f"ksl: note: {', '.join(rigid)}: not in {file}, and therefore rigid; they take what the other joints of the loops would share")
        return stiff, ledger.files
    except ValueError as e:
        fail(f"{e}" if str(e).startswith(str(file)) else f"{file}: {e}")


def joints_without(model: Model, given: Iterable[str]) -> list[str]:
    """The joints of the loops, from either end to where their ways to the ground meet, that are not among those given."""
    names: dict[str, None] = {}
    for loop in model.loops:
        ways = [model.support(link) for link in (loop.predecessor, loop.successor)]
        names.update(dict.fromkeys(joint for way, other in (ways, ways[::-1]) for joint in way if joint not in other))
        names[loop.name] = None
    known = set(given)
    return [name for name in names if name not in known]
