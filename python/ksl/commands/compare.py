"""`ksl compare`."""

from __future__ import annotations

from typing import Annotated

import typer

from ksl.commands.app import app, console, fail, print_json
from ksl.commands.options import FloatingBase, ModelName, Packages, Physics, RobotText, Strict, Xacro, described_warnings, in_options, xacro_arguments


@app.command()
def compare(
    robot: RobotText,
    libraries: Annotated[
        str, typer.Option("--with", metavar="NAMES", help="Libraries, separated by commas: pinocchio, mujoco, drake; otherwise those of them that are installed.")
    ] = "",
    floating_base: FloatingBase = False,
    strict: Strict = False,
    model_name: ModelName = "",
    physics: Physics = "",
    states: Annotated[int, typer.Option("--states", metavar="N", help="How many random states, 1 to 1000.")] = 8,
    xacro: Xacro = None,
    package: Packages = [],
    seed: Annotated[int, typer.Option("--seed", metavar="N", help="Of the random states.")] = 0,
    json: Annotated[bool, typer.Option("--json", help="Print everything as JSON.")] = False,
) -> None:
    """Compare a robot with other libraries: which numbers differ at random states, in which conventions, and whose rule explains it.

    Exit status: 0 all numbers agree, 1 some differ and it is known why, 2 it is not known why, or there was nothing to compare with.
    """
    from ksl.commands.print_compare import print_comparison
    from ksl.comparison.compare_robot import compare as compare_robot

    names = [word.strip() for word in libraries.split(",")] if libraries else None
    on = [word.strip() for word in physics.split(",")] if physics else None
    with described_warnings():
        try:
            found = compare_robot(
                robot, names, floating_base=floating_base, strict=strict, model=model_name or None, physics=on, states=states, seed=seed, xacro=xacro_arguments(xacro, package)
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
