"""`ksl loads`: `ksl.compute_loads` and `Run.write`, with options for their arguments."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, cast

import typer

from ksl.commands.app import GroupedOptions, app, command_line, console, discard_output, fail, is_of_printing, unwritable
from ksl.commands.motion_options import MOTION_HELP, MotionOptions, of_motion
from ksl.commands.options import (
    AxesOf,
    Components,
    Folder,
    OnLinks,
    OnSide,
    OrderOf,
    PointMasses,
    Replace,
    Robot,
    RobotOptions,
    WriteCsv,
    WriteJson,
    WritePdf,
    WriteMat,
    WriteRrd,
    WriteMcap,
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

if TYPE_CHECKING:
    from ksl.load_cases.case_files.given_cases import PlacementError
    from ksl.model.model import Model
    from ksl.mechanism.states import Order, Side
    from ksl.report.pdf import Paper


@app.command(cls=GroupedOptions)
@of_robot("gravity", "physics", "friction_width")
@of_motion()
def loads(
    robot: Robot,
    motion: Annotated[Path | None, typer.Argument(metavar="[MOTION]", help=MOTION_HELP)] = None,
    cases: Annotated[Path | None, typer.Option(metavar="FILE.toml", help="Load cases: docs/cases.md. MOTION is then that of cases that name none.")] = None,
    output: Folder = Path("loads"),
    csv: WriteCsv = False,
    xlsx: WriteXlsx = False,
    mcap: WriteMcap = False,
    mat: WriteMat = False,
    rrd: WriteRrd = False,
    json: WriteJson = False,
    pdf: WritePdf = False,
    components: Components = None,
    paper: Annotated[str, typer.Option(metavar="A4|letter", help="Paper of the PDF.")] = "A4",
    on: OnSide = "child",
    at: Annotated[
        list[str],
        typer.Option(
            metavar="POINT",
            help="Point of the moments: joint, world, a link's name, or X,Y,Z from the joint's origin in its axes; JOINT=X,Y,Z for one joint (repeatable).",
        ),
    ] = [],
    axes: AxesOf = "joint",
    order: OrderOf = "lin_ang",
    joints: Annotated[str, typer.Option(metavar="NAMES", help="Joints whose wrenches are wanted, separated by commas; otherwise all.")] = "",
    payload: PointMasses = [],
    on_link: OnLinks = [],
    external: Annotated[
        Path | None, typer.Option(metavar="FILE.csv", help="Wrenches on links: `time` and LINK.fx … LINK.tz, at the link's origin, in its axes.")
    ] = None,
    smooth: Annotated[
        float | None, typer.Option("--smooth", metavar="HZ", help="Low-pass measured positions at this frequency, without delay, before differentiating.")
    ] = None,
    fail_on: Annotated[
        str | None, typer.Option("--fail-on", metavar="limits", help="End with status 3 if a limit is exceeded, of components too; results are written.")
    ] = None,
    force: Replace = False,
    how: RobotOptions = RobotOptions(),
    stiffness: Stiffness = None,
    deflection: Annotated[
        str, typer.Option("--deflection", metavar="FRAME", help="Write deflection.csv: where this link is off along the motion, by the joints of --stiffness.")
    ] = "",
    reading: MotionOptions = MotionOptions(),
) -> None:
    """Compute the wrench through every joint along a motion and write wrenches.parquet, summary.csv and report.html.

    A table has `time` and a column for each moving joint (rad, m), and NAME.v and NAME.a if its rates are known.

    A floating base has the columns floating_base.x .y .z .qx .qy .qz .qw (pose in the world) and, if its rates are known,
    floating_base.vx .vy .vz .wx .wy .wz and .ax .ay .az .bx .by .bz (twist in the body's frame and its componentwise derivative).

    A spherical joint has the columns NAME.qx .qy .qz .qw (a unit quaternion) and, if known, NAME.wx .wy .wz (angular velocity in
    the child's axes) and NAME.bx .by .bz (its componentwise derivative). docs/motions.md lists those of cylindrical, universal,
    planar and translation joints, and what each format of motions may hold.
    """
    from ksl.commands.print_loads import print_run, progress
    from ksl.load_cases.case_files.given_cases import PlacementError
    from ksl.output import OutputError
    from ksl.report.compute_loads import compute_loads
    from ksl.report.files import ReportFiles
    from ksl.report.result_files import DEFLECTION
    from ksl.small_motions.deflections import deflections

    _check_words(fail_on, motion, cases, external, paper)
    loaded = payloads_given(payload, on_link)
    if len(loaded) != len(on_link):
        fail(f"--on-link {max(on_link, key=on_link.count)} is given more than once; a link carries one payload")
    if motion is not None:
        check_order(robot, motion)
    model, stiff = with_stiffness(read_model(robot, how, loaded), stiffness, deflection)
    common, own = _points(at)
    try:
        report = ReportFiles.wanted(json, cast("Paper", paper) if pdf else None, components)
        run = compute_loads(
            model, motion, cases, payloads=carried_payloads(model, loaded), external=external, on=cast("Side", on), at=_numbers(common, own), axes=axes,
            order=cast("Order", order), joints=[name.strip() for name in joints.split(",")] if joints else [], reading={**asdict(reading), "smooth": smooth},
            when="asked", inputs=stiff, options={"at": at, "joints": joints, **_of_robot(model, how, stiffness, deflection)}, command=command_line(),
        )  # fmt: skip
        out = console(120)
        off = deflections(run.cases, deflection, stiffness) if deflection else None
        with progress(out, run) as advance:
            files = run.write(output, csv, force, advance, report, {DEFLECTION: off.write} if off else {}, xlsx, mcap, mat, rrd)
        print_run(out, run, [*([str(off)] if off else []), f"written to {output}: {', '.join(files)}", f"report: {output / 'report.html'}"])
    except BrokenPipeError:  # nobody reads what is printed: as any command
        raise
    except PlacementError as e:
        _refused(e, model, own, joints)
    except (ValueError, OutputError, RuntimeError) as e:  # RuntimeError: an unknown KSL_ISA
        fail(in_options(e, on=on, at=common, axes=axes, order=order))
    except OSError as e:
        if not is_of_printing(e):
            raise
        discard_output()
        fail(f"{unwritable(e)}; results are in {output}")
    if fail_on and (run.verdict.exceeded or (run.sizing and run.sizing.exceeded)):
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


def _points(at: list[str]) -> tuple[str, dict[str, str]]:
    """The words of the common point of the moments, and of those of single joints."""
    common = [point for point in at if "=" not in point]
    if len(common) > 1:
        fail(f"--at {common[1]}: the second point for all joints; give JOINT=X,Y,Z for single joints")
    own = [one.rpartition("=") for one in at if "=" in one]
    return common[0] if common else "joint", {joint: xyz for joint, _, xyz in own}


def _numbers(common: str, own: dict[str, str]) -> dict[str | None, str | list[float]]:
    """The points of moments as `ksl.compute_loads` takes them: {joint: words, or three numbers}, at None for all joints."""
    return {None: numbers(common, "--at", 3) if "," in common else common, **{joint: numbers(xyz, f"--at {joint}=", 3) for joint, xyz in own.items()}}


def _of_robot(model: Model, how: RobotOptions, stiffness: Path | None, deflection: str) -> dict[str, Any]:
    """What the record of the results says of the robot."""
    said: dict[str, Any] = {"floating_base": how.floating_base, "mimic": how.mimic, "strict": how.strict, "gravity": how.gravity, "model": how.model_name}
    said |= {"physics": how.physics, "friction_width": how.friction_width if how.physics else None}
    said |= {"loops": how.loops, "drives": how.drives, "stiffness": str(stiffness or "")} if model.loops or how.loops else {}
    said |= {"deflection": deflection, "stiffness": str(stiffness)} if deflection else {}
    return said | {name: value for name, value in (("xacro", how.xacro), ("package", how.package)) if value}


def _refused(error: PlacementError, model: Model, points: dict[str, str], joints: str) -> NoReturn:
    """Says of an option what is wrong with its joint."""
    if error.left_out:
        fail(f"--at {error.joint}=…: a point of a joint that --joints leaves out; add it there, or leave out the point")
    option = f"--joints {joints}" if error.argument == "joints" else f"--at {error.joint}={points[error.joint]}"
    names = [*(j.name for j in model.joints), *model.loop_names]
    fail(f"{option}: no joint {error.joint!r}; {suggestion(error.joint, names, f'the joints of {model.name} are')}")
