"""`--stiffness FILE.toml`: stiffnesses of the joints of a closed mechanism."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ksl.commands.app import fail

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
        return model.with_stiffness(given), ledger.files
    except ValueError as e:
        fail(f"{e}" if str(e).startswith(str(file)) else f"{file}: {e}")
