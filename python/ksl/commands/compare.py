"""`ksl compare`."""

from __future__ import annotations

from typing import Annotated

import typer

from ksl.commands.app import app, console, fail, print_json
from ksl.commands.options import FIXED, RobotOptions, RobotText, described_warnings, in_options, of_robot, xacro_arguments


@app.command()
@of_robot("physics", without=FIXED["compare"])
def compare(
    robot: RobotText,
    libraries: Annotated[
        str,
        typer.Option("--with", metavar="NAMES", help="Libraries, separated by commas: pinocchio, mujoco, drake; otherwise those of them that are installed."),
    ] = "",
    how: RobotOptions = RobotOptions(),
    states: Annotated[int, typer.Option("--states", metavar="N", help="How many random states, 1 to 1000.")] = 8,
    seed: Annotated[int, typer.Option("--seed", metavar="N", help="Of the random states.")] = 0,
    json: Annotated[bool, typer.Option("--json", help="Print everything as JSON.")] = False,
) -> None:
    """Compare a robot with other libraries: which numbers differ at random states, in which conventions, and whose rule explains it.

    Exit status: 0 all numbers agree, 1 some differ and it is known why, 2 it is not known why, or there was nothing to compare with.
    """
    from ksl.commands.print_compare import print_comparison
    from ksl.comparison.compare_robot import compare as compare_robot

    names = [word.strip() for word in libraries.split(",")] if libraries else None
    with described_warnings():
        try:
            found = compare_robot(
                robot,
                names,
                floating_base=how.floating_base,
                strict=how.strict,
                model=how.model_name or None,
                physics=how.physics_named,
                states=states,
                seed=seed,
                xacro=xacro_arguments(how.xacro, how.package),
            )
        except ValueError as e:
            from ksl.base.errors import ArgumentError

            fail(f"--with{e.rest}" if isinstance(e, ArgumentError) and e.argument == "libraries" else in_options(e, states=states, seed=seed))
    if json:
        print_json(found.as_dict())
    else:
        print_comparison(found, console(120), asked=names is not None)
    missing = bool(found.missing) and names is not None  # what was asked for by name
    raise typer.Exit(max(found.status, 2 if missing else 0))
