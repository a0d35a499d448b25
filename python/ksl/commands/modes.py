"""`ksl modes`: `ksl.frequencies`, with options for its arguments."""

from __future__ import annotations

import os
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ksl.commands.app import GroupedOptions, app, console, fail
from ksl.commands.motion_options import MotionOptions, of_motion
from ksl.commands.options import OnLinks, PointMasses, Robot, RobotOptions, check_order, file_with_a_name, named_number, of_robot, payloads_given, read_model
from ksl.commands.stiffness_option import StiffnessOfJoints

if TYPE_CHECKING:
    from ksl.model.model import Model
    from ksl.small_motions.frequencies import Frequencies


@app.command(cls=GroupedOptions)
@of_robot("gravity", "physics")
@of_motion()
def modes(
    robot: Robot,
    stiffness: StiffnessOfJoints = None,
    pose: Annotated[
        list[str], typer.Option(metavar="FILE|NAME=VALUE", help="Position of a joint, rad or m, or 90deg (repeatable); or a TOML file of positions.")
    ] = [],
    motion: Annotated[Path | None, typer.Option("--motion", metavar="FILE", help="Frequencies along a motion.")] = None,
    grid: Annotated[
        list[str], typer.Option("--grid", metavar="JOINT=FROM:TO:N", help="Over N positions of a joint, rad or m; repeated: every combination.")
    ] = [],
    count: Annotated[int, typer.Option("--count", metavar="N", help="So many frequencies, from the lowest.")] = 6,
    samples: Annotated[int, typer.Option("--samples", metavar="N", help="Of the motion, evenly spaced, at most.")] = 200,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", parser=file_with_a_name, metavar="FILE.csv", help="A row for each pose: time, positions, frequencies in Hz."),
    ] = None,
    export: Annotated[
        Path | None,
        typer.Option("--export", metavar="FILE.html", help="Show the shape of a mode, of the pose with the lowest frequency, in a file that opens offline."),
    ] = None,
    mode: Annotated[int, typer.Option("--mode", metavar="N", help="Which one --export shows.")] = 1,
    show: Annotated[bool, typer.Option("--show", help="Show the shapes of that pose in a page on this machine, until Ctrl-C.")] = False,
    payload: PointMasses = [],
    on_link: OnLinks = [],
    how: RobotOptions = RobotOptions(),
    reading: MotionOptions = MotionOptions(),
) -> None:
    """Print the natural frequencies of a robot whose joints give way, in a pose, along a motion, or over a grid of poses."""
    from ksl.commands.print_modes import print_modes
    from ksl.output import OutputError, refuse_inputs
    from ksl.small_motions.frequencies import frequencies

    if motion is not None:
        check_order(robot, motion)
    model = read_model(robot, how, payloads_given(payload, on_link))
    if stiffness is None:
        fail("modes needs stiffnesses: --stiffness FILE.toml, with a table [JOINT] for each joint that gives way; docs/modes.md")
    read = [str(path) for path in (robot, motion, stiffness) if path is not None]
    try:
        found = frequencies(
            model, motion, pose=_positions(model, pose), grid=_grid(grid), stiffness=stiffness, count=count, samples=samples, reading=asdict(reading) if motion is not None else None,
        )  # fmt: skip
        if output is not None:
            refuse_inputs([output], read)
            found.write(output)
        if export is not None:
            refuse_inputs([export], read)
            _export(found, export, mode)
    except (ValueError, OutputError) as e:
        fail(e)
    print_modes(console(120), found, [f"written to {path}" for path in (output, export) if path is not None])
    if show:
        _show(found)


def _export(found: Frequencies, path: Path, mode: int) -> None:
    from ksl.base.words import count as count_of
    from ksl.viewer.export import export
    from ksl.viewer.shape_scene import scene_of_shape, title_of

    if not 0 < mode <= len(found.modes.frequencies):
        fail(f"--mode {mode}: the pose has {count_of(len(found.modes.frequencies), 'mode')}; expected one of them, from 1 on")
    title = title_of(mode, found.modes.frequencies[mode - 1])
    export(scene_of_shape(found.model, found.q[found.lowest], found.modes.shapes[mode - 1], title), path, subtitle=title)


def _show(found: Frequencies) -> None:
    from ksl.base.errors import ViewerError
    from ksl.commands.view import serve
    from ksl.viewer.shape_scene import scenes_of_modes

    try:
        scenes = scenes_of_modes(found.model, found.q[found.lowest], found.modes)
        serve(next(iter(scenes.values())), scenes=scenes)
    except (ValueError, ViewerError) as e:
        fail(e)


def _positions(model: Model, given: list[str]) -> dict[str, Any] | None:
    from ksl.load_cases.holding import read_pose

    positions: dict[str, Any] = {}
    for one in given:
        if "=" in one and not os.path.exists(one):
            name, value = named_number(one, "--pose")
            if name in positions:
                fail(f"--pose {name}=…: is given twice; a joint has one position")
            positions[name] = value
        else:
            positions |= read_pose(model, one, None)
    return positions or None


def _grid(given: list[str]) -> dict[str, list[float]] | None:
    """JOINT=FROM:TO:N, each."""
    import numpy as np

    found: dict[str, list[float]] = {}
    for one in given:
        name, _, words = one.rpartition("=")
        try:
            low, high, n = words.split(":")
            start, stop, many = float(low), float(high), int(n)
        except ValueError:
            start = stop = many = 0
        if not name or many < 1 or not np.isfinite([start, stop]).all():
            fail(f"--grid {one}: expected JOINT=FROM:TO:N, positions in rad or m, and how many")
        if name in found:
            fail(f"--grid {name}=…: is given twice; a joint has one row of positions")
        found[name] = np.linspace(start, stop, many).tolist()
    return found or None
