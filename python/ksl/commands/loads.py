"""`ksl loads`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from ksl.commands.app import app, command_line, console, discard_output, end_on_signals, fail, unwritable
from ksl.commands.options import (
    ColumnMapFile,
    Degrees,
    FloatingBase,
    FrictionWidth,
    From,
    Gravity,
    IgnoreExtra,
    Mimic,
    ModelName,
    MotionFile,
    Physics,
    PositionsOnly,
    Resample,
    Robot,
    Strict,
    TimeUnit,
    To,
    Topic,
    check_order,
    in_options,
    numbers,
    read_model,
)

if TYPE_CHECKING:
    from ksl.report.pdf import Paper
    from ksl.states import Order, Side


@app.command()
def loads(
    robot: Robot,
    motion: MotionFile,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Folder for the results.")] = Path("loads"),
    csv: Annotated[bool, typer.Option("--csv", help="Write wrenches.csv beside wrenches.parquet.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Write report.json, everything that the report says in numbers.")] = False,
    pdf: Annotated[bool, typer.Option("--pdf", help="Write report.pdf, printed by Chromium or Chrome.")] = False,
    components: Annotated[Path | None, typer.Option(metavar="FILE.toml", help="Components that the report checks against the loads; see ksl size.")] = None,
    paper: Annotated[str, typer.Option(metavar="A4|letter", help="Paper of the PDF.")] = "A4",
    on: Annotated[str, typer.Option(metavar="child|parent", help="Side that the wrench acts on.")] = "child",
    at: Annotated[str, typer.Option(metavar="POINT", help="Point of the moments: joint, world, a link's name, or X,Y,Z from the joint's origin in its axes.")] = "joint",
    axes: Annotated[str, typer.Option(metavar="AXES", help="joint, world, or a link's name.")] = "joint",
    order: Annotated[str, typer.Option(metavar="lin_ang|ang_lin", help="Force or moment first.")] = "lin_ang",
    payload: Annotated[list[str], typer.Option(metavar="MASS[,X,Y,Z]", help="Point mass, kg, at a point of the link's frame, m; with --on-link.")] = [],
    on_link: Annotated[list[str], typer.Option(metavar="NAME", help="Link that carries the payload.")] = [],
    external: Annotated[Path | None, typer.Option(metavar="FILE.csv", help="Wrenches on links: `time` and LINK.fx … LINK.tz, at the link's origin, in its axes.")] = None,
    smooth: Annotated[float | None, typer.Option("--smooth", metavar="HZ", help="Low-pass measured positions at this frequency, without delay, before differentiating.")] = None,
    fail_on: Annotated[str, typer.Option("--fail-on", metavar="limits", help="End with status 3 if a limit is exceeded; results are written.")] = "",
    floating_base: FloatingBase = False,
    mimic: Mimic = "coupled",
    strict: Strict = False,
    gravity: Gravity = "",
    model_name: ModelName = "",
    physics: Physics = "",
    friction_width: FrictionWidth = 0.01,
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
    from ksl.load_cases.load_case import LoadCase, Payload, Placement
    from ksl.load_cases.output import OutputError
    from ksl.load_cases.provenance import input_file, provenance_of
    from ksl.load_cases.run import run_loads
    from ksl.motions.reading import read_external, read_motion
    from ksl.report.files import ReportFiles

    if fail_on not in ("", "limits"):
        fail(f"--fail-on {fail_on}: expected limits")
    if len(payload) != len(on_link):
        fail(f"{len(payload)} --payload and {len(on_link)} --on-link; give one --on-link NAME for each --payload MASS[,X,Y,Z]")
    if len(set(on_link)) != len(on_link):
        fail(f"--on-link {max(on_link, key=on_link.count)} is given more than once; a link carries one payload")
    if paper not in ("A4", "letter"):
        fail(f"--paper {paper}: expected A4 or letter")
    values = [numbers(p, "--payload", 1, 4) for p in payload]
    end_on_signals()
    check_order(robot, motion)
    loaded = {link: (p[0], p[1:] or [0.0, 0.0, 0.0]) for link, p in zip(on_link, values)}
    model = read_model(robot, floating_base, mimic, strict, gravity, loaded, name=model_name, physics=physics, friction_width=friction_width)
    point = numbers(at, "--at", 3) if "," in at else at
    try:
        model._request(on, point, axes, order, "total", [])
    except ValueError as e:
        fail(in_options(e, on=on, at=at, axes=axes, order=order))
    placement = Placement(cast("Side", on), point, axes, cast("Order", order))  # the request was not refused
    reading: dict[str, Any] = {
        "map": columns, "degrees": degrees, "time_unit": time_unit, "resample": resample, "start": start, "stop": stop,
        "ignore_extra": ignore_extra, "topic": topic, "positions_only": positions_only, "smooth": smooth,
    }  # fmt: skip
    try:
        report = ReportFiles.wanted(json, cast("Paper", paper) if pdf else None, components)
        moved = read_motion(model, motion, **reading)
        wrenches = read_external(model, external, moved.time) if external else {}
        carried = [Payload(link, kilograms, (x, y, z)) for link, (kilograms, (x, y, z)) in loaded.items()]
        case = LoadCase(model, moved, placement, wrenches, motion.stem, str(motion), carried)
        inputs = [input_file(role, file) for role, file in (("robot", robot), ("motion", motion), ("map", columns), ("external", external)) if file]
        options = {"on": on, "at": at, "axes": axes, "order": order, "floating_base": floating_base, "mimic": mimic, "strict": strict}
        options |= {"gravity": gravity, "model": model_name, "physics": physics, "friction_width": friction_width if physics else None}
        options |= {name: str(value) if name == "map" else value for name, value in reading.items() if value not in (None, False)}
        verdict = run_loads(case, provenance_of([case], inputs, options, command_line()), output, csv, console(120), report)
    except BrokenPipeError:  # nobody reads what is printed: as any command
        raise
    except (ValueError, OutputError, RuntimeError) as e:  # RuntimeError: an unknown KSL_ISA
        fail(e)
    except OSError as e:
        discard_output()
        fail(f"{unwritable(e)}; results are in {output}")
    if fail_on and verdict.exceeded:
        raise typer.Exit(3)
