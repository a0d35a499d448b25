"""`ksl hold`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from ksl.commands.app import GroupedOptions, app, command_line, console, fail
from ksl.commands.options import (
    AxesOf,
    OnLinks,
    OnSide,
    OrderOf,
    PointMasses,
    Replace,
    Robot,
    RobotOptions,
    carried_payloads,
    in_options,
    named_number,
    numbers,
    of_robot,
    path_with_a_name,
    payloads_given,
    read_model,
)
from ksl.commands.stiffness_option import Stiffness, with_stiffness

if TYPE_CHECKING:
    from ksl.model.model import Model
    from ksl.mechanism.states import Order, Side


@app.command(cls=GroupedOptions)
@of_robot("gravity", "physics")
def hold(
    robot: Robot,
    pose: Annotated[
        list[str],
        typer.Option(metavar="FILE|NAME=VALUE", help="Position of a joint, rad or m, or 90deg (repeatable); or a file: TOML of positions, or a motion."),
    ] = [],
    time: Annotated[float | None, typer.Option("--time", metavar="S", help="Which sample of a motion; otherwise the first.")] = None,
    worst: Annotated[str, typer.Option(metavar="JOINT", help="Search the pose within limits that is worst for this joint; joints of --pose stay.")] = "",
    of: Annotated[
        str, typer.Option("--of", metavar="QUANTITY", help="What is largest there: effort, fx … tz, force, moment, axial_force, bending_moment …")
    ] = "effort",
    seed: Annotated[int, typer.Option(metavar="N", help="Of the search.")] = 0,
    output: Annotated[Path | None, typer.Option("--output", "-o", parser=path_with_a_name, metavar="DIR", help="Folder for files as of `ksl loads`.")] = None,
    xlsx: Annotated[bool, typer.Option("--xlsx", help="With -o: results.xlsx too, a workbook with a sheet for each table.")] = False,
    force: Replace = False,
    on: OnSide = "child",
    at: Annotated[
        str, typer.Option(metavar="POINT", help="Point of the moments: joint, world, a link's name, or X,Y,Z from the joint's origin in its axes.")
    ] = "joint",
    axes: AxesOf = "joint",
    order: OrderOf = "lin_ang",
    payload: PointMasses = [],
    on_link: OnLinks = [],
    how: RobotOptions = RobotOptions(),
    stiffness: Stiffness = None,
) -> None:
    """Print the efforts and every wrench of one pose at rest, or of the worst pose for a joint."""
    from ksl.base.files_read import recorded
    from ksl.commands.print_loads import print_pose
    from ksl.load_cases.holding import read_pose
    from ksl.output import OutputError
    from ksl.report.hold_pose import hold as held

    if xlsx and output is None:
        fail("--xlsx writes results.xlsx into a folder; give it by -o DIR")
    loaded = payloads_given(payload, on_link)
    model = read_model(robot, how, loaded)
    model, stiff = with_stiffness(model, stiffness)
    point = numbers(at, "--at", 3) if "," in at else at
    try:
        model.reaction_request(on, point, axes, order, "total", [])
    except ValueError as e:
        fail(in_options(e, on=on, at=at, axes=axes, order=order))
    files = [one for one in pose if "=" not in one or os.path.exists(one)]
    named = _positions([one for one in pose if one not in files])
    _check_words(model, files, time, of, worst, seed)
    try:
        positions: dict[str, Any] = {}
        with recorded() as ledger:
            for file in files:
                positions |= read_pose(model, file, time)
        positions |= named
        carried = carried_payloads(model, loaded)
        options = {
            "on": on,
            "at": at,
            "axes": axes,
            "order": order,
            "gravity": how.gravity,
            "physics": how.physics,
            "mimic": how.mimic,
            "floating_base": how.floating_base,
        }
        options |= {"loops": how.loops, "drives": how.drives, "stiffness": str(stiffness or "")} if model.loops or how.loops else {}
        run = held(
            model, positions, worst or None, of, payloads=carried, on=cast("Side", on), at=point, axes=axes, order=cast("Order", order), seed=seed,
            inputs=[*stiff, *ledger.files], options=options, command=command_line(),
        )  # fmt: skip
        written = run.write(output, force=force, xlsx=xlsx) if output else []
    except (ValueError, OutputError, RuntimeError) as e:
        fail(e)
    out = console(120)
    print_pose(out, run, [f"written to {output}: {', '.join(written)}"] if output else [])


def _check_words(model: Model, files: list[str], time: float | None, of: str, worst: str, seed: int) -> None:
    """Fails where options miss or contradict each other."""
    for file in files:
        if file in model.joint_names and not os.path.exists(file):
            fail(f"--pose {file}: a joint, without its position; give {file}=VALUE, rad or m, or as 90deg")
    if time is not None and not files:
        fail(f"--time {time:g}: chooses a sample of a motion; give one with --pose FILE")
    if of != "effort" and not worst:
        fail(f"--of {of}: what is searched with --worst JOINT; give it, or leave out --of")
    if seed < 0:
        fail(f"--seed {seed}: expected 0 or more")


def _positions(given: list[str]) -> dict[str, float]:
    named: dict[str, float] = {}
    for name, value in (named_number(text, "--pose") for text in given):
        if name in named:
            fail(f"--pose {name}=…: is given twice; a joint has one position")
        named[name] = value
    return named
