"""`ksl loads`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from ksl.base.errors import name_among
from ksl.base.files_read import recorded
from ksl.base.printable import one_line
from ksl.commands.app import GroupedOptions, app, command_line, console, discard_output, fail, is_of_printing, unwritable
from ksl.commands.options import (
    MOTION_HELP,
    AxesOf,
    ColumnMapFile,
    Components,
    Degrees,
    Folder,
    From,
    IgnoreExtra,
    OnLinks,
    OnSide,
    OrderOf,
    PointMasses,
    PositionsOnly,
    Replace,
    Resample,
    Robot,
    RobotOptions,
    TimeUnit,
    To,
    Topic,
    WriteCsv,
    WriteJson,
    WritePdf,
    WriteXlsx,
    carried_payloads,
    check_order,
    in_options,
    numbers,
    of_robot,
    payloads_given,
    read_model,
    suggestion,
)
from ksl.commands.stiffness_option import Stiffness, with_stiffness
from ksl.commands.write_run import written

if TYPE_CHECKING:
    from ksl.base.files_read import InputFile
    from ksl.load_cases.load_case import LoadCase, Payload, Placement
    from ksl.model.model import Model
    from ksl.mechanism.states import Order, Side
    from ksl.report.loads_run import Run
    from ksl.report.pdf import Paper


@app.command(cls=GroupedOptions)
@of_robot("gravity", "physics", "friction_width")
def loads(
    robot: Robot,
    motion: Annotated[Path | None, typer.Argument(metavar="[MOTION]", help=MOTION_HELP)] = None,
    cases: Annotated[Path | None, typer.Option(metavar="FILE.toml", help="Load cases: docs/cases.md. MOTION is then that of cases that name none.")] = None,
    output: Folder = Path("loads"),
    csv: WriteCsv = False,
    xlsx: WriteXlsx = False,
    json: WriteJson = False,
    pdf: WritePdf = False,
    components: Components = None,
    paper: Annotated[str, typer.Option(metavar="A4|letter", help="Paper of the PDF.")] = "A4",
    on: OnSide = "child",
    at: Annotated[list[str], typer.Option(metavar="POINT", help="Point of the moments: joint, world, a link's name, or X,Y,Z from the joint's origin in its axes; JOINT=X,Y,Z for one joint (repeatable).")] = [],
    axes: AxesOf = "joint",
    order: OrderOf = "lin_ang",
    joints: Annotated[str, typer.Option(metavar="NAMES", help="Joints whose wrenches are wanted, separated by commas; otherwise all.")] = "",
    payload: PointMasses = [],
    on_link: OnLinks = [],
    external: Annotated[Path | None, typer.Option(metavar="FILE.csv", help="Wrenches on links: `time` and LINK.fx … LINK.tz, at the link's origin, in its axes.")] = None,
    smooth: Annotated[float | None, typer.Option("--smooth", metavar="HZ", help="Low-pass measured positions at this frequency, without delay, before differentiating.")] = None,
    fail_on: Annotated[str | None, typer.Option("--fail-on", metavar="limits", help="End with status 3 if a limit is exceeded; results are written.")] = None,
    force: Replace = False,
    how: RobotOptions = RobotOptions(),
    stiffness: Stiffness = None,
    columns: ColumnMapFile = None,
    degrees: Degrees = False,
    time_unit: TimeUnit = None,
    resample: Resample = None,
    start: From = None,
    stop: To = None,
    ignore_extra: IgnoreExtra = False,
    topic: Topic = None,
    positions_only: PositionsOnly = False,
) -> None:
    """Compute the wrench through every joint along a motion and write wrenches.parquet, summary.csv and report.html.

    A table has `time` and a column for each moving joint (rad, m), and NAME.v and NAME.a if its rates are known.

    A floating base has the columns floating_base.x .y .z .qx .qy .qz .qw (pose in the world) and, if its rates are known,
    floating_base.vx .vy .vz .wx .wy .wz and .ax .ay .az .bx .by .bz (twist in the body's frame and its componentwise derivative).

    A spherical joint has the columns NAME.qx .qy .qz .qw (a unit quaternion) and, if known, NAME.wx .wy .wz (angular velocity in
    the child's axes) and NAME.bx .by .bz (its componentwise derivative). docs/motions.md lists those of cylindrical, universal,
    planar and translation joints, and what each format of motions may hold.
    """
    from ksl.commands.print_loads import print_run
    from ksl.output import OutputError
    from ksl.report.files import ReportFiles

    _check_words(fail_on, motion, cases, external, paper)
    loaded = payloads_given(payload, on_link)
    if len(loaded) != len(on_link):
        fail(f"--on-link {max(on_link, key=on_link.count)} is given more than once; a link carries one payload")
    if motion is not None:
        check_order(robot, motion)
    model = read_model(robot, how, loaded)
    model, stiff = with_stiffness(model, stiffness)
    placement = _placement(model, on, at, axes, order, joints)
    reading: dict[str, Any] = {
        "map": columns, "degrees": degrees, "time_unit": time_unit, "resample": resample, "start": start, "stop": stop,
        "ignore_extra": ignore_extra, "topic": topic, "positions_only": positions_only, "smooth": smooth,
    }  # fmt: skip
    options = {"on": on, "at": at, "axes": axes, "order": order, "joints": joints, "floating_base": how.floating_base, "mimic": how.mimic}
    options |= {"strict": how.strict, "gravity": how.gravity, "model": how.model_name, "physics": how.physics, "friction_width": how.friction_width if how.physics else None}
    options |= {"loops": how.loops, "drives": how.drives, "stiffness": str(stiffness or "")} if model.loops or how.loops else {}
    options |= {name: value for name, value in (("xacro", how.xacro), ("package", how.package)) if value}
    options |= {name: str(value) if name == "map" else value for name, value in reading.items() if value not in (None, False)}
    try:
        report = ReportFiles.wanted(json, cast("Paper", paper) if pdf else None, components)
        run = _run(model, stiff, motion, cases, external, columns, placement, loaded, reading, options)
        out = console(120)
        files = written(run, output, out, csv, force, report, xlsx=xlsx)
        print_run(out, run, [f"written to {output}: {', '.join(files)}", f"report: {output / 'report.html'}"])
    except BrokenPipeError:  # nobody reads what is printed: as any command
        raise
    except (ValueError, OutputError, RuntimeError) as e:  # RuntimeError: an unknown KSL_ISA
        fail(e)
    except OSError as e:
        if not is_of_printing(e):
            raise
        discard_output()
        fail(f"{unwritable(e)}; results are in {output}")
    if fail_on and run.verdict.exceeded:
        raise typer.Exit(3)


def _check_words(fail_on: str | None, motion: Path | None, cases: Path | None, external: Path | None, paper: str) -> None:
    """Fails where options miss or contradict each other."""
    if fail_on not in (None, "limits"):
        fail(f"--fail-on {fail_on or 'with an empty word'}: expected limits")
    if motion is None and cases is None:
        fail("loads needs a motion: ksl loads ROBOT MOTION, or ksl loads ROBOT --cases FILE.toml")
    if cases is not None and external is not None:
        fail("--external and --cases: external wrenches of load cases are in their file, as external = [...]")
    if paper not in ("A4", "letter"):
        fail(f"--paper {paper}: expected A4 or letter")


def _run(
    model: Model, read: list[InputFile], motion: Path | None, cases: Path | None, external: Path | None, columns: Path | None, placement: Placement,
    loaded: dict[str, tuple[float, list[float]]], reading: dict[str, Any], options: dict[str, Any],
) -> Run:  # fmt: skip
    """The load cases that the arguments name, with what made them.  read: files beside that of the robot."""
    from ksl.load_cases.provenance import provenance_of
    from ksl.report.loads_run import Run

    carried = carried_payloads(model, loaded)
    found, files = _cases(model, motion, cases, external, placement, carried, reading)
    inputs = [*model.inputs, *read, *files]
    return Run(found, provenance_of(found, inputs, options, command_line()))


def _cases(
    model: Model, motion: Path | None, cases: Path | None, external: Path | None, placement: Placement, carried: list[Payload],
    reading: dict[str, Any],
) -> tuple[list[LoadCase], list[InputFile]]:  # fmt: skip
    """The load cases, and the files that they come from.  reading: how motions are read, in a file of cases those without options."""
    from ksl.load_cases.case_file import read_cases
    from ksl.load_cases.load_case import LoadCase
    from ksl.motions.reading import read_motion, read_wrenches

    if cases is not None:
        return read_cases(model, cases, placement, motion, carried, reading)
    assert motion is not None
    with recorded() as ledger:
        moved = read_motion(model, motion, **reading)
        wrenches, doubts = read_wrenches(model, external, moved.time) if external else ({}, [])
    moved = replace(moved, doubts=[*moved.doubts, *doubts])
    return [LoadCase(model, moved, placement, wrenches, "standard input" if str(motion) == "-" else one_line(motion.stem), str(motion), carried)], ledger.files


def _placement(model: Model, on: str, at: list[str], axes: str, order: str, joints: str) -> Placement:
    """Where and how wrenches are expressed.  `at` holds one common point, and JOINT=X,Y,Z of single joints."""
    from ksl.load_cases.load_case import Placement

    common = [point for point in at if "=" not in point]
    if len(common) > 1:
        fail(f"--at {common[1]}: the second point for all joints; give JOINT=X,Y,Z for single joints")
    text = common[0] if common else "joint"
    point = numbers(text, "--at", 3) if "," in text else text
    points: dict[str, list[float]] = {}
    for given, _, xyz in (one.rpartition("=") for one in at if "=" in one):
        name = _known(model, given, f"--at {given}={xyz}")
        points[name] = numbers(xyz, f"--at {name}=", 3)
    chosen = [_known(model, name.strip(), f"--joints {joints}") for name in joints.split(",")] if joints else []
    for name in points:
        if chosen and name not in chosen:
            fail(f"--at {name}=…: a point of a joint that --joints leaves out; add it there, or leave out the point")
    try:
        model.reaction_request(on, point, axes, order, "total", [])
    except ValueError as e:
        fail(in_options(e, on=on, at=text, axes=axes, order=order))
    return Placement(cast("Side", on), point, axes, cast("Order", order), points, chosen)  # the request was not refused


def _known(model: Model, joint: str, option: str) -> str:
    names = [*(j.name for j in model.joints), *model.loop_names]
    plain: str = name_among(names, joint, "joint")
    if plain not in names:
        fail(f"{option}: no joint {joint!r}; {suggestion(joint, names, f'the joints of {model.name} are')}")
    return plain
