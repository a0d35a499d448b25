"""`ksl actuation`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from ksl.commands.app import GroupedOptions, app, command_line, console, fail, print_json, say
from ksl.commands.options import Folder, Replace, Robot, RobotOptions, in_options, named_number, numbers, of_robot, read_model

if TYPE_CHECKING:
    from ksl.drivetrain.judged_limits import JudgedLimit
    from ksl.drivetrain.serial import Limits
    from ksl.report.compute_actuation import ActuationRun


@app.command(cls=GroupedOptions)
@of_robot("gravity", "physics")
def actuation(
    robot: Robot,
    output: Folder,
    joints: Annotated[
        str, typer.Option("--joints", metavar="NAME,NAME", help="The joints that motors move through rods: all of one mechanism, or of several.")
    ],
    motion: Annotated[
        Path | None, typer.Option("--motion", metavar="FILE", help="A motion of these joints and of those that carry them: what motors and rods bear along it.")
    ] = None,
    check: Annotated[list[Path], typer.Option("--check", metavar="FILE", help="Another file of the robot, whose limits are judged too (repeatable).")] = [],
    pose: Annotated[
        str,
        typer.Option("--at", metavar="Q,Q", help="Positions of the joints, in their order, through which curves go, and at which the serial model is exact."),
    ] = "",
    start: Annotated[
        list[str],
        typer.Option(
            metavar="NAME=VALUE",
            help="Where a joint is, rad or m, or 90deg, in the position that all is followed from (repeatable); others follow. By default near neutral.",
        ),
    ] = [],
    limits: Annotated[
        str, typer.Option(metavar="safe|mean", help="Limits of the serial model: the largest box that holds at every position, or the mean of boxes.")
    ] = "safe",
    json: Annotated[bool, typer.Option("--json", help="Print the limits as JSON instead.")] = False,
    force: Replace = False,
    how: RobotOptions = RobotOptions(),
) -> None:
    """Write what motors do to joints through rods: maps, limits of files beside the true ones, the serial model for simulators, and a report.

    Files: report.html, maps and motion as Parquet and CSV, serial.urdf and serial.xml, a tree with the armature of rods and rotors, closed.xml, the
    mechanism as MJCF with its loops, and leg_maps.h and .c, the maps in both directions for firmware.
    """
    from ksl.output import OutputError
    from ksl.commands.print_notes import print_unused
    from ksl.report.compute_actuation import compute_actuation

    names = [word.strip() for word in joints.split(",") if word.strip()]
    model = read_model(robot, how, {})
    positions = dict(named_number(one, "--start") for one in start)
    if len(positions) < len(start):
        fail("--start: a joint is given twice; it has one position")
    at = numbers(pose, "--at", len(names)) if pose else None
    try:
        run = compute_actuation(model, names, motion, check=check, at=at, limits=cast("Limits", limits), start=positions or None, command=command_line())
        written = run.write(output, force)
    except (ValueError, OutputError) as e:
        fail(in_options(e, joints=joints, limits=limits, at=pose))
    if json:
        print_json([_row(row) for row in run.limits])
    else:
        _print(run, output, written)
        print_unused(console(120), model)


def _row(row: JudgedLimit) -> dict[str, object]:
    """Numbers that JSON doesn't have are None."""
    return {key: None if isinstance(x, float) and x - x != 0 else x for key, x in vars(row).items()}


def _print(run: ActuationRun, output: Path, written: list[str]) -> None:
    out, a = console(120), run.actuation
    say(out, f"{', '.join(a.joints)} by {', '.join(a.motors)}")
    for row in run.limits:
        if row.judgement in ("too large", "partly too large", "not judged"):
            say(out, f"{row.file}: joint {row.joint}: {row.what} limit {row.given:.4g} is {row.judgement}: {row.reason}")
    for k, name in enumerate(a.joints):
        joint, e = run.serial.joint(name), run.errors
        said = f"armature {joint.armature:.4g}, efforts off by {e.root_mean_square[k]:.3g} root mean square over the range, {e.naive_root_mean_square[k]:.3g} without rods and rotors"
        say(out, f"serial model: {name}: {said}")
    if run.motion is not None:
        for k, name in enumerate(a.motors):
            peak, static = (float(abs(x[:, k]).max()) for x in (run.motion.efforts, run.motion.efforts - run.motion.static))
            say(out, f"motion: {name}: {peak:.4g} at most, of which the static map misses {static:.3g}")
        for doubt in run.motion.doubts:
            say(out, f"  doubt: {doubt}")
    say(out, f"written to {output}: {', '.join(written)}")
