"""`ksl info`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ksl.commands.app import app, console, fail
from ksl.commands.options import RobotOptions, of_robot, read_model


@app.command()
@of_robot("gravity", "physics")
def info(
    robot: Annotated[Path | None, typer.Argument(metavar="ROBOT", help="Robot file: URDF, SDF, MJCF (with the package mujoco) or USD (with usd-core).")] = None,
    how: RobotOptions = RobotOptions(),
    cpu: Annotated[bool, typer.Option("--cpu", help="Say which instruction set the kernels use here.")] = False,
) -> None:
    """Print a robot's tree, joints, limits, masses, gravity, degrees of freedom, and what its file holds that is not used."""
    from ksl._core import instruction_set
    from ksl.commands.print_info import print_info

    if cpu:
        try:
            print(f"kernels: {instruction_set()}")
        except RuntimeError as e:
            fail(e)
    elif robot is None:
        fail("info needs a robot file, or --cpu")
    if robot is not None:
        print_info(read_model(robot, how, masses="optional"), console(80))
