"""`ksl view`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ksl.commands.app import GroupedOptions, app, errors, fail
from ksl.commands.options import (
    DEFAULT_FRICTION_WIDTH,
    ColumnMapFile,
    Degrees,
    Drives,
    FloatingBase,
    FrictionWidth,
    Gravity,
    IgnoreExtra,
    Loops,
    Mimic,
    ModelName,
    Packages,
    Physics,
    PositionsOnly,
    Robot,
    Strict,
    TimeUnit,
    Topic,
    Xacro,
    check_order,
    read_model,
)

if TYPE_CHECKING:
    from ksl.model.model import Model
    from ksl.viewer.results_scene import Results
    from ksl.viewer.scene import Scene


NOTES = 5
"""How many notes are printed: a robot without any of its meshes has dozens."""


@app.command(cls=GroupedOptions)
def view(
    robot: Robot,
    motion: Annotated[Path | None, typer.Argument(metavar="MOTION|RESULTS", help="A motion, as for `ksl loads`, or the folder that `ksl loads` has written; otherwise the robot at rest.")] = None,
    export: Annotated[Path | None, typer.Option(metavar="FILE.html", help="Write scene and playback into one file that opens offline, and end.")] = None,
    joint: Annotated[str, typer.Option(metavar="NAME", help="Joint that is selected first, whose wrench is written beside it.")] = "",
    case: Annotated[str, typer.Option(metavar="NAME", help="Which load case of the results; otherwise the first.")] = "",
    external: Annotated[Path | None, typer.Option(metavar="FILE.csv", help="Wrenches on links along the motion: `time` and LINK.fx … LINK.tz.")] = None,
    package_path: Annotated[list[Path], typer.Option(metavar="DIR", help="Folder in which packages of package:// meshes are looked for; may be repeated.")] = [],
    port: Annotated[int | None, typer.Option(metavar="PORT", help="Of the page, on 127.0.0.1; otherwise 8080 or a free one.")] = None,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in a browser.")] = True,
    floating_base: FloatingBase = False,
    mimic: Mimic = "coupled",
    gravity: Gravity = "",
    model_name: ModelName = "",
    physics: Physics = "",
    friction_width: FrictionWidth = 0.01,
    loops: Loops = "",
    drives: Drives = "",
    xacro: Xacro = None,
    package: Packages = [],
    strict: Strict = False,
    columns: ColumnMapFile = None,
    degrees: Degrees = False,
    time_unit: TimeUnit = None,
    ignore_extra: IgnoreExtra = False,
    topic: Topic = None,
    positions_only: PositionsOnly = False,
) -> None:
    """Show a robot, a motion or results of `ksl loads` with the wrenches at the joints, in a page on this machine or in a file.

    Force arrows have one head, moments two.  Blue is what the structure carries, orange what the drive exerts.
    """
    from ksl.base.errors import ViewerError
    from ksl.commands.print_notes import print_unused
    from ksl.output import OutputError, refuse_inputs
    from ksl.viewer.results_scene import is_results, read_results

    if case and (motion is None or not is_results(motion)):
        fail(f"--case {case}: only results of `ksl loads` have load cases; give the folder that it has written")
    for folder in package_path:
        if not folder.is_dir():
            fail(f"--package-path {folder}: no such folder")
    if external is not None and (motion is None or is_results(motion)):
        fail(f"--external {external}: needs a motion, whose times it has")
    if motion is not None:
        check_order(robot, motion)
    results: Results | None = None
    try:
        if export is not None:
            refuse_inputs([export], [file for file in (robot, motion, external, columns, None if loops in ("", "cut") else Path(loops)) if file is not None])
        if motion is not None and is_results(motion):
            results = read_results(motion, case or None)
        model = _model(robot, results, floating_base, mimic, gravity, model_name, physics, friction_width, loops, drives, xacro, package, strict)
        reading = {"map": columns, "degrees": degrees, "time_unit": time_unit, "ignore_extra": ignore_extra, "topic": topic, "positions_only": positions_only}
        scene = _scene(model, results, motion, reading, external, package_path)
        if joint:
            scene.joint_index(joint)
    except (ValueError, OutputError, RuntimeError) as e:  # RuntimeError: an unknown KSL_ISA
        fail(e)
    _print_notes(scene)
    print_unused(errors, model, drawn=bool(scene.look.shapes))
    try:
        if export is not None:
            from ksl.viewer.export import export as write

            write(scene, export, joint=joint or None, subtitle=f"{results.case}: {motion}" if results else str(motion or "at rest"))
            print(f"written: {export} ({export.stat().st_size / 1e6:.1f} MB)")
            return
        _serve(scene, port, joint, browser)
    except ViewerError as e:
        fail(e)


def _scene(model: Model, results: Results | None, motion: Path | None, reading: dict[str, Any], external: Path | None, package_path: list[Path]) -> Scene:
    """What the page shows: results, a motion, or the robot at rest."""
    from ksl.motions.reading import read_external, read_motion
    from ksl.viewer.results_scene import scene_of_motion, scene_of_results
    from ksl.viewer.scene import make_scene

    if results is not None:
        scene, notes = scene_of_results(model, results, package_path)
        scene.look.notes[:0] = notes
        return scene
    if motion is None:
        return make_scene(model, package_paths=package_path)
    moved = read_motion(model, motion, **reading)
    wrenches = read_external(model, external, moved.time) if external else {}
    return scene_of_motion(model, moved.time, moved.q, moved.v, moved.a, wrenches, package_path)


def _print_notes(scene: Scene) -> None:
    for note in scene.look.notes[:NOTES]:
        errors.print(f"ksl: note: {note}")
    if scene.unloaded:
        errors.print(f"ksl: note: no wrenches are shown; {scene.unloaded}")
    if len(scene.look.notes) > NOTES:
        errors.print(f"ksl: note: and {len(scene.look.notes) - NOTES} more of this kind")


def _model(
    robot: Path, results: Results | None, floating_base: bool, mimic: str, gravity: str, model_name: str, physics: str, friction_width: float,
    loops: str, drives: str, xacro: str | None, package: list[str], strict: bool,
) -> Model:
    """The robot, with what results say of it where no option does."""
    import numpy as np

    from ksl.model.surgery import with_compliances

    made, options = (results.description, results.made_by.get("options", {})) if results else ({}, {})
    floating_base, mimic = floating_base or bool(options.get("floating_base")), options.get("mimic", mimic) if mimic == "coupled" else mimic
    model_name = model_name or options.get("model") or ""
    gravity = gravity or ",".join(f"{g!r}" for g in made.get("gravity", []))
    physics = physics or ",".join(made.get("physics", []))
    if friction_width == DEFAULT_FRICTION_WIDTH:
        friction_width = float(options.get("friction_width") or friction_width)
    loops = loops or (_loops_of(results) if results else "")
    drives = drives or ",".join(made.get("drives", []))
    xacro, package = options.get("xacro") if xacro is None else xacro, package or list(options.get("package") or [])
    model = read_model(
        robot, floating_base, mimic, strict, gravity, name=model_name, physics=physics, friction_width=friction_width, loops=loops, drives=drives,
        xacro=xacro, package=package,
    )
    for p in made.get("payloads", []):
        model = model.with_payload(p["link"], float(p["mass"]), p["center"], np.reshape(p["inertia"], (3, 3)) if "inertia" in p else None)
    if made.get("drive_weights") and list(model.drives or ()) == made["drives"]:
        model = model.with_drives(dict(zip(made["drives"], made["drive_weights"], strict=True)))
    return with_compliances(model, made["compliance"]) if made.get("compliance") else model


def _loops_of(results: Results) -> str:
    """The file of the joints that close loops, or that those of the robot's file were cut."""
    if results.made_by.get("options", {}).get("loops") == "cut":
        return "cut"
    files = [f["file"] for f in results.made_by.get("inputs", []) if f["role"] == "loops"]
    return str(Path(str(results.made_by.get("directory", ""))) / files[0]) if files else ""


def _serve(scene: Scene, port: int | None, joint: str, browser: bool) -> None:
    from ksl.viewer.labels import labels
    from ksl.viewer.live import Viewer

    with Viewer(scene, port, joint or None) as viewer:
        print(f"{viewer.url} shows {labels([scene.model.name], 'robot')[0]}; Ctrl-C ends", flush=True)
        if browser and not viewer.open():
            errors.print(f"ksl: no browser could be opened; open {viewer.url} in one")
        viewer.wait()
