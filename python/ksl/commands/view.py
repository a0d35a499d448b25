"""`ksl view`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated

import typer

from ksl.commands.app import GroupedOptions, app, errors, fail
from ksl.commands.motion_options import MotionOptions, of_motion
from ksl.commands.options import DEFAULT_FRICTION_WIDTH, Robot, RobotOptions, check_order, of_robot, read_model

if TYPE_CHECKING:
    from ksl.model.model import Model
    from ksl.load_cases.results_table import SavedCase
    from ksl.viewer.scene import Scene


NOTES = 5
"""How many notes are printed: a robot without any of its meshes has dozens."""


@app.command(cls=GroupedOptions)
@of_robot("gravity", "physics", "friction_width")
@of_motion(without=("resample", "start", "stop"))
def view(
    robot: Robot,
    motion: Annotated[
        Path | None,
        typer.Argument(metavar="MOTION|RESULTS", help="A motion, as for `ksl loads`, or the folder that `ksl loads` has written; otherwise the robot at rest."),
    ] = None,
    export: Annotated[Path | None, typer.Option(metavar="FILE.html", help="Write scene and playback into one file that opens offline, and end.")] = None,
    joint: Annotated[str, typer.Option(metavar="NAME", help="Joint that is selected first, whose wrench is written beside it.")] = "",
    case: Annotated[str, typer.Option(metavar="NAME", help="Which load case of the results; otherwise the first.")] = "",
    external: Annotated[Path | None, typer.Option(metavar="FILE.csv", help="Wrenches on links along the motion: `time` and LINK.fx … LINK.tz.")] = None,
    package_path: Annotated[
        list[Path], typer.Option(metavar="DIR", help="Folder in which packages of package:// meshes are looked for; may be repeated.")
    ] = [],
    port: Annotated[int | None, typer.Option(metavar="PORT", help="Of the page, on 127.0.0.1; otherwise 8080 or a free one.")] = None,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in a browser.")] = True,
    how: RobotOptions = RobotOptions(),
    reading: MotionOptions = MotionOptions(),
) -> None:
    """Show a robot, a motion or results of `ksl loads` with the wrenches at the joints, in a page on this machine or in a file.

    Force arrows have one head, moments two.  Blue is what the structure carries, orange what the drive exerts.
    """
    from ksl.base.errors import ViewerError
    from ksl.commands.print_notes import print_unused
    from ksl.output import OutputError, refuse_inputs
    from ksl.load_cases.results_table import is_results, read_results

    if case and (motion is None or not is_results(motion)):
        fail(f"--case {case}: only results of `ksl loads` have load cases; give the folder that it has written")
    for folder in package_path:
        if not folder.is_dir():
            fail(f"--package-path {folder}: no such folder")
    if external is not None and (motion is None or is_results(motion)):
        fail(f"--external {external}: needs a motion, whose times it has")
    if motion is not None:
        check_order(robot, motion)
    results: SavedCase | None = None
    try:
        if export is not None:
            refuse_inputs(
                [export], [file for file in (robot, motion, external, reading.map, None if how.loops in ("", "cut") else Path(how.loops)) if file is not None]
            )
        if motion is not None and is_results(motion):
            results = read_results(motion, case or None)
        model = _model(robot, results, how)
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
        serve(scene, port, joint, browser)
    except ViewerError as e:
        fail(e)


def _scene(model: Model, results: SavedCase | None, motion: Path | None, reading: MotionOptions, external: Path | None, package_path: list[Path]) -> Scene:
    """What the page shows: results, a motion, or the robot at rest."""
    from ksl.motions.reading import read_motion, read_wrenches
    from ksl.viewer.results_scene import scene_of_motion, scene_of_results
    from ksl.viewer.scene import make_scene

    if results is not None:
        scene, notes = scene_of_results(model, results, package_path)
        scene.look.notes[:0] = notes
        return scene
    if motion is None:
        return make_scene(model, package_paths=package_path)
    moved = read_motion(model, motion, **asdict(reading))
    wrenches, doubts = read_wrenches(model, external, moved.time) if external else ({}, [])
    scene = scene_of_motion(model, moved.time, moved.q, moved.v, moved.a, wrenches, package_path)
    scene.look.notes[:0] = [*moved.doubts, *doubts]
    return scene


def _print_notes(scene: Scene) -> None:
    for note in scene.look.notes[:NOTES]:
        errors.print(f"ksl: note: {note}")
    if scene.unloaded:
        errors.print(f"ksl: note: no wrenches are shown; {scene.unloaded}")
    if len(scene.look.notes) > NOTES:
        errors.print(f"ksl: note: and {len(scene.look.notes) - NOTES} more of this kind")


def _model(robot: Path, results: SavedCase | None, how: RobotOptions) -> Model:
    """The robot, with what results say of it where no option does."""
    from ksl.load_cases.case_files.results_model import as_described, loops_of

    made, options = (results.description, results.made_by.get("options", {})) if results else ({}, {})
    of_results = replace(
        how,
        floating_base=how.floating_base or bool(options.get("floating_base")),
        mimic=options.get("mimic", how.mimic) if how.mimic == "coupled" else how.mimic,
        gravity=how.gravity or ",".join(f"{g!r}" for g in made.get("gravity", [])),
        model_name=how.model_name or options.get("model") or "",
        physics=how.physics or ",".join(made.get("physics", [])),
        friction_width=float(options.get("friction_width") or how.friction_width) if how.friction_width == DEFAULT_FRICTION_WIDTH else how.friction_width,
        loops=how.loops or (loops_of(results) if results else ""),
        drives=how.drives or ",".join(made.get("drives", [])),
        xacro=options.get("xacro") if how.xacro is None else how.xacro,
        package=how.package or list(options.get("package") or []),
    )
    model = read_model(robot, of_results)
    return as_described(model, made)


def serve(scene: Scene, port: int | None = None, joint: str = "", browser: bool = True, scenes: Mapping[str, Scene] = MappingProxyType({})) -> None:
    """Serves a page until Ctrl-C; scenes: as of :class:`Viewer`.  Raises ViewerError."""
    from ksl.viewer.labels import labels
    from ksl.viewer.live import Viewer

    with Viewer(scene, port, joint or None, scenes) as viewer:
        print(f"{viewer.url} shows {labels([scene.model.name], 'robot')[0]}; Ctrl-C ends", flush=True)
        if browser and not viewer.open():
            errors.print(f"ksl: no browser could be opened; open {viewer.url} in one")
        viewer.wait()
