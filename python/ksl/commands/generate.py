"""`ksl generate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, cast

import typer

from ksl.commands.app import app, console, fail
from ksl.commands.options import Robot, RobotOptions, in_options, of_robot, path_with_a_name, read_model


@app.command()
@of_robot("gravity", "physics", "friction_width")
def generate(
    robot: Robot,
    algorithms: Annotated[str, typer.Option(metavar="NAMES", help="Calls of models, with links or joints behind a colon: inverse_dynamics,jacobian:tool0,reactions:elbow+base; vjp.reactions: its derivative backward, jvp.: forward.")],
    output: Annotated[Path, typer.Option("--output", "-o", parser=path_with_a_name, metavar="DIR", help="Folder for the files.")],
    name: Annotated[str, typer.Option(metavar="NAME", help="Prefix of files and functions.")] = "robot",
    scalar: Annotated[str, typer.Option(metavar="double|float", help="Precision of all numbers.")] = "double",
    arguments: Annotated[str, typer.Option(metavar="NAMES", help="Inputs besides: external:LINK+LINK (a wrench on each link), gravity, payload:LINK (added to its inertia), parameters:LINK (in place of it).")] = "",
    contract: Annotated[bool, typer.Option("--contract", help="Let compilers fuse products and sums: faster, and no longer KSL's results to the bit.")] = False,
    undetermined: Annotated[str, typer.Option(metavar="refuse|least-norm", help="Reactions of closed mechanisms that rigid bodies leave open.")] = "refuse",
    lanes: Annotated[int, typer.Option(metavar="N", help="Functions of arrays of states, too, N of which are computed at a time: 4 doubles with AVX2, 8 with AVX-512.")] = 0,
    flash: Annotated[int, typer.Option(metavar="BYTES", help="Refuse code that is larger, constants included, by the estimate of README.md.")] = 0,
    abi: Annotated[str, typer.Option(metavar="c|casadi", help="casadi: NAME_casadi.c, too, which CasADi loads, with Jacobians.")] = "c",
    derivatives: Annotated[int, typer.Option(metavar="1|2", help="For CasADi: Jacobians, or second derivatives, too, as Ipopt's exact Hessian takes them.")] = 1,
    force: Annotated[bool, typer.Option("--force", help="Replace files of others with these names in DIR.")] = False,
    how: RobotOptions = RobotOptions(),
) -> None:
    """Write algorithms of this robot as plain C: one header, one source, no library.

    Beside them a self-test, files for CMake and PlatformIO, and README.md with order, units and the number of operations.
    """
    from ksl.generation.generate import generate as write
    from ksl.generation.open_reactions import Undetermined
    from ksl.output import OutputError

    model = read_model(robot, how)
    words = [word for word in arguments.split(",") if word]
    try:
        files = write(model, algorithms.split(","), output, name, cast(Literal["double", "float"], scalar), words, contract, force, cast(Undetermined, undetermined), lanes, flash, cast(Literal["c", "casadi"], abi), derivatives)
    except (ValueError, OutputError) as e:
        fail(in_options(e, scalar=scalar, name=name, undetermined=undetermined, lanes=lanes, flash=flash, abi=abi, derivatives=derivatives))
    console(120).print(f"written: {', '.join(str(path) for path in files)}", highlight=False, soft_wrap=True, markup=False)
