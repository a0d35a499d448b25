"""`ksl generate`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal, cast
from zipfile import ZipFile

import typer

from ksl.commands.app import app, console, fail
from ksl.commands.options import Robot, RobotOptions, in_options, of_robot, path_with_a_name, read_model


@app.command()
@of_robot("gravity", "physics", "friction_width")
def generate(
    robot: Robot,
    output: Annotated[
        Path, typer.Option("--output", "-o", parser=path_with_a_name, metavar="DIR", help="Folder for the files; of an FMU, FILE.fmu or its folder.")
    ],
    algorithms: Annotated[
        str,
        typer.Option(
            metavar="NAMES",
            help="Calls of models, with links or joints behind a colon: inverse_dynamics,jacobian:tool0,reactions:elbow+base; vjp.reactions: its derivative backward, jvp.: forward.",
        ),
    ] = "",
    name: Annotated[str, typer.Option(metavar="NAME", help="Prefix of files and functions.")] = "robot",
    scalar: Annotated[str, typer.Option(metavar="double|float", help="Precision of all numbers.")] = "double",
    arguments: Annotated[
        str,
        typer.Option(
            metavar="NAMES",
            help="Inputs besides: external:LINK+LINK (a wrench on each link), gravity, payload:LINK (added to its inertia), parameters:LINK (in place of it).",
        ),
    ] = "",
    contract: Annotated[bool, typer.Option("--contract", help="Let compilers fuse products and sums: faster, and no longer KSL's results to the bit.")] = False,
    undetermined: Annotated[str, typer.Option(metavar="refuse|least-norm", help="Reactions of closed mechanisms that rigid bodies leave open.")] = "refuse",
    lanes: Annotated[
        int, typer.Option(metavar="N", help="Functions of arrays of states, too, N of which are computed at a time: 4 doubles with AVX2, 8 with AVX-512.")
    ] = 0,
    flash: Annotated[int, typer.Option(metavar="BYTES", help="Refuse code that is larger, constants included, by the estimate of README.md.")] = 0,
    abi: Annotated[str, typer.Option(metavar="c|casadi", help="casadi: NAME_casadi.c, too, which CasADi loads, with Jacobians.")] = "c",
    derivatives: Annotated[
        int, typer.Option(metavar="1|2", help="For CasADi: Jacobians, or second derivatives, too, as Ipopt's exact Hessian takes them.")
    ] = 1,
    cuda: Annotated[
        bool, typer.Option("--cuda", help="NAME.cuh and NAME.cu, too: functions for a thread of a graphics card, and kernels of many states.")
    ] = False,
    pivots: Annotated[
        bool, typer.Option("--pivots", help="Sizes of the pivots of closed mechanisms as a last result, which tell before results are NaN.")
    ] = False,
    fmu: Annotated[
        str,
        typer.Option(
            "--fmu",
            metavar="forward|inverse",
            help="An FMU for co-simulation (FMI 3.0) in place of algorithms: efforts in and a mechanism in motion, or a motion in and efforts out; reactions out.",
        ),
    ] = "",
    joints: Annotated[str, typer.Option("--joints", metavar="NAME,NAME", help="With --fmu: whose reactions are outputs; none: of no joint.")] = "all",
    method: Annotated[str, typer.Option(metavar="rk4|semi_implicit_euler", help="With --fmu forward: the method, as that of ksl simulate.")] = "rk4",
    step: Annotated[float, typer.Option(metavar="S", help="With --fmu forward: its longest step.")] = 1e-3,
    force: Annotated[bool, typer.Option("--force", help="Replace files of others with these names in DIR.")] = False,
    how: RobotOptions = RobotOptions(),
) -> None:
    """Write algorithms of this robot as plain C: one header, one source, no library.

    Beside them a self-test, files for CMake and PlatformIO, and README.md with order, units and the number of operations.
    """
    from ksl.commands.print_notes import print_unused
    from ksl.generation.fmus.fmu import fmu as write_fmu
    from ksl.generation.generate import generate as write
    from ksl.generation.open_reactions import Undetermined
    from ksl.output import OutputError

    of_code = {
        "--arguments": arguments != "", "--contract": contract, "--lanes": lanes != 0, "--flash": flash != 0, "--abi": abi != "c",
        "--derivatives": derivatives != 1, "--cuda": cuda, "--pivots": pivots,
    }  # fmt: skip
    _refuse(fmu, algorithms, of_code, {"--joints": joints != "all", "--method": method != "rk4", "--step": step != 1e-3})
    model = read_model(robot, how)
    words = [word for word in arguments.split(",") if word]
    named = {"all": None, "none": []}.get(joints, joints.split(","))
    try:
        precision, open_reactions = cast(Literal["double", "float"], scalar), cast(Undetermined, undetermined)
        if fmu:
            kind, stepped = cast(Literal["forward", "inverse"], fmu), cast(Literal["rk4", "semi_implicit_euler"], method)
            files = [write_fmu(model, output, kind, name, named, stepped, step, open_reactions, None, force, precision)]
        else:
            files = write(
                model, algorithms.split(","), output, name, precision, words, contract, force, open_reactions, lanes, flash,
                cast(Literal["c", "casadi"], abi), derivatives, cuda, pivots,
            )  # fmt: skip
    except (ValueError, OutputError) as e:
        said = in_options(
            e,
            scalar=scalar,
            name=name,
            undetermined=undetermined,
            lanes=lanes,
            flash=flash,
            abi=abi,
            derivatives=derivatives,
            kind=fmu,
            method=method,
            step=step,
        )
        fail(said.replace("--kind", "--fmu").replace("\n    ", " "))  # what a compiler says
    alone = "" if not fmu or _has_binary(files[0]) else ", sources alone, since there is no compiler of C for a binary"
    out = console(120)
    print_unused(out, model)
    out.print(f"written: {', '.join(str(path) for path in files)}{alone}", highlight=False, soft_wrap=True, markup=False)


def _refuse(fmu: str, algorithms: str, of_code: Mapping[str, bool], of_fmu: Mapping[str, bool]) -> None:
    """Ends with a sentence where an option is for what isn't written."""
    if not fmu and not algorithms:
        fail("--algorithms: name some, as inverse_dynamics or jacobian:LINK; or ask for an FMU: --fmu forward")
    refused = {"--algorithms": bool(algorithms), **of_code} if fmu else of_fmu
    for option in [option for option, given in refused.items() if given]:
        fail(
            f"{option}: is not for an FMU, which has functions of its own; leave it out"
            if fmu
            else f"{option}: is for an FMU; ask for one with --fmu forward, or leave it out"
        )
    for option in [option for option in ("--method", "--step") if fmu == "inverse" and of_fmu[option]]:
        fail(f"{option}: is for --fmu forward; a motion that is given has no steps of its own; leave it out")


def _has_binary(file: Path) -> bool:
    with ZipFile(file) as there:
        return any(name.startswith("binaries/") for name in there.namelist())
