"""`--stiffness FILE.toml`: stiffnesses of joints."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ksl.commands.app import fail

if TYPE_CHECKING:
    from ksl.base.files_read import InputFile
    from ksl.model.model import Model

Stiffness = Annotated[
    Path | None,
    typer.Option(
        "--stiffness",
        metavar="FILE.toml",
        help="Stiffnesses of joints, or components that have some: they decide what rigid bodies leave open in a robot with loops.",
    ),
]

StiffnessOfJoints = Annotated[
    Path | None,
    typer.Option(
        "--stiffness",
        metavar="FILE.toml",
        help="Stiffnesses of joints: a table [JOINT] with axial, radial, tilting, torsional and motion for each; or components that have stiffnesses.",
    ),
]


def with_stiffness(model: Model, file: Path | None, deflection: str = "") -> tuple[Model, list[InputFile]]:
    """The model with the stiffnesses of a file, and the files that were read; fails where they can't be used.

    deflection: a frame whose deflection is wanted, which depends on them without loops, too.
    """
    if file is None:
        if deflection:
            fail(f"--deflection {deflection}: needs the stiffnesses of joints; give them by --stiffness FILE.toml")
        return model, []
    from ksl.base.files_read import recorded
    from ksl.mechanism.stiffness import table_of
    from ksl.robot_files.stiffness_file import stiff_by

    if not model.loops and not deflection:
        fail(f"--stiffness {file}: {model.name} has no loops, so that no result depends on stiffnesses; leave it out")
    try:
        if deflection:
            model.frame_link(deflection)
        with recorded() as ledger:
            if model.loops:
                model, _ = stiff_by(model, file)  # what it leaves out is among the notes of the run
            else:
                table_of(model, file)  # judged: no wrench depends on them
    except ValueError as e:
        fail(str(e))
    return model, ledger.files
