"""`ksl simulate`."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from ksl.base.files_read import recorded
from ksl.commands.app import GroupedOptions, app, command_line, console, fail
from ksl.commands.motion_options import MOTION_HELP
from ksl.commands.options import (
    Components,
    Folder,
    OnLinks,
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
    named_number,
    numbers,
    of_robot,
    payloads_given,
    read_model,
)
from ksl.commands.stiffness_option import Stiffness, with_stiffness

if TYPE_CHECKING:
    from ksl.base.files_read import InputFile
    from ksl.load_cases.load_case import LoadCase, Payload
    from ksl.load_cases.case_files.simulated import Simulated
    from ksl.model.model import Model
    from ksl.motions.motion import Motion


@app.command(cls=GroupedOptions)
@of_robot("gravity", "physics", "friction_width")
def simulate(
    robot: Robot,
    motion: Annotated[Path | None, typer.Argument(metavar="[MOTION]", help=f"Followed by the controller, or left at a time. {MOTION_HELP}")] = None,
    until: Annotated[float | None, typer.Option(metavar="S", help="End; otherwise that of MOTION.")] = None,
    state: Annotated[
        str,
        typer.Option(
            "--start",
            metavar="FILE",
            help="Begin in the state of this motion, its first or that of --from-time, and follow nothing; or at rest in a pose of TOML.",
        ),
    ] = "",
    start: Annotated[float | None, typer.Option("--from-time", metavar="S", help="Begin in the state of MOTION, or of --start, at this time.")] = None,
    pose: Annotated[
        list[str], typer.Option(metavar="FILE|NAME=VALUE", help="Position where it begins at rest, rad or m, or 90deg (repeatable); or a file, as of ksl hold.")
    ] = [],
    velocity: Annotated[list[str], typer.Option(metavar="NAME=VALUE", help="Velocity where it begins, rad/s or m/s (repeatable).")] = [],
    controller: Annotated[str, typer.Option(metavar="none|gravity|pd|computed-torque", help="What drives the joints.")] = "none",
    gains: Annotated[
        str, typer.Option(metavar="STIFFNESS,DAMPING", help="Of pd, N m/rad and N m s/rad; of computed-torque, 1/s² and 1/s; of gravity damping alone.")
    ] = "",
    brake_at: Annotated[float | None, typer.Option("--brake-at", metavar="S", help="Brakes engage, and the drives have no effort from then on.")] = None,
    brake: Annotated[list[str], typer.Option(metavar="[NAME=]EFFORT", help="What brakes hold, N m or N; otherwise the effort limits (repeatable).")] = [],
    dry_friction: Annotated[list[str], typer.Option("--dry-friction", metavar="[NAME=]EFFORT", help="Dry friction that sticks and slips (repeatable).")] = [],
    bounce: Annotated[float | None, typer.Option("--bounce", metavar="E", help="Joints stop at their limits, with this coefficient of restitution.")] = None,
    rate: Annotated[float | None, typer.Option(metavar="HZ", help="Samples a second of the result; 250.")] = None,
    method: Annotated[str, typer.Option(metavar="NAME", help="dop853, rk4, rkmk4, sdirk4, variational or semi_implicit_euler; docs/simulation.md.")] = "dop853",
    step: Annotated[float | None, typer.Option(metavar="S", help="Step of methods without error control.")] = None,
    tolerance: Annotated[float | None, typer.Option(metavar="E", help="Error of a step of dop853, relative and absolute; 1e-9.")] = None,
    cases: Annotated[Path | None, typer.Option(metavar="FILE.toml", help="Load cases instead, some with simulate = {…}: docs/cases.md.")] = None,
    output: Folder = Path("simulated"),
    csv: WriteCsv = False,
    xlsx: WriteXlsx = False,
    mcap: WriteMcap = False,
    mat: WriteMat = False,
    rrd: WriteRrd = False,
    json: WriteJson = False,
    pdf: WritePdf = False,
    components: Components = None,
    force: Replace = False,
    payload: PointMasses = [],
    on_link: OnLinks = [],
    how: RobotOptions = RobotOptions(),
    stiffness: Stiffness = None,
) -> None:
    """Simulate a mechanism under a controller, without drives or under brakes, and write motion.csv and every wrench, as ksl loads.

    It begins at --pose, at rest but for --velocity, or in the state of MOTION or --start. pd holds that pose, or follows MOTION, and carries the weight;
    computed-torque does so by inverse dynamics. docs/simulation.md says which method to take.
    """
    from ksl.commands.print_loads import print_run, progress
    from ksl.load_cases.provenance import provenance_of
    from ksl.output import OutputError
    from ksl.report.files import ReportFiles
    from ksl.report.loads_run import Run

    if motion is not None:
        check_order(robot, motion)
    said = {
        "--until": until, "--start": state, "--from-time": start, "--pose": pose, "--velocity": velocity, "--gains": gains, "--brake-at": brake_at, "--brake": brake,
        "--dry-friction": dry_friction, "--bounce": bounce, "--rate": rate, "--step": step, "--tolerance": tolerance,
        "--controller": controller != "none", "--method": method != "dop853",
    }  # fmt: skip
    _check_words(cases, motion, said)
    loaded = payloads_given(payload, on_link)
    model = read_model(robot, how, loaded)
    model, stiff = with_stiffness(model, stiffness)
    carried = carried_payloads(model, loaded)
    options = {
        "until": until, "start": state, "from": start, "pose": pose, "velocity": velocity, "controller": controller, "gains": gains, "brake_at": brake_at, "brake": brake,
        "dry_friction": dry_friction, "bounce": bounce, "rate": rate, "method": method, "step": step, "tolerance": tolerance,
        "gravity": how.gravity, "physics": how.physics, "loops": how.loops, "drives": how.drives, "xacro": how.xacro or "", "package": how.package, "stiffness": str(stiffness or ""),
    }  # fmt: skip
    try:
        if cases is not None:
            from ksl.load_cases.case_files.case_file import read_cases

            found, files = read_cases(model, cases, None, motion, carried)
        else:
            wanted, files = _how(
                model, until, state, start, pose, velocity, controller, gains, brake_at, brake, dry_friction, bounce, rate, method, step, tolerance
            )
            case, read = _case(model, wanted, motion, carried)
            found, files = [case], [*files, *read]
        run = Run(found, provenance_of(found, [*model.inputs, *stiff, *files], {k: v for k, v in options.items() if v not in (None, "", [])}, command_line()))
        out, report = console(120), ReportFiles.wanted(json, "A4" if pdf else None, components)
        with progress(out, run) as advance:
            names = run.write(output, csv, force, advance, report, _motions(model, found), xlsx, mcap, mat, rrd)
        print_run(out, run, [f"written to {output}: {', '.join(names)}", f"report: {output / 'report.html'}"])
    except BrokenPipeError:  # nobody reads what is printed: as any command
        raise
    except (ValueError, OutputError, RuntimeError) as e:  # RuntimeError: an unknown KSL_ISA
        fail(e)


def _check_words(cases: Path | None, motion: Path | None, said: dict[str, Any]) -> None:
    """Refuses options that say the same twice, and a run without an end."""
    if cases is not None:
        if others := [name for name, value in said.items() if value not in (None, "", [], False)]:
            fail(f"{', '.join(others)}: with --cases each load case says so itself, in simulate = {{…}}; leave {'it' if len(others) == 1 else 'them'} out")
        return
    if said["--start"] and (motion is not None or said["--pose"]):
        fail(f"--start: {'MOTION' if motion is not None else '--pose'} says where it begins; leave one of them out")
    if said["--until"] is None and motion is None:
        fail("--until: the end is missing; give it, s, or a MOTION that has one")


def _how(
    model: Model, until: float | None, state: str, start: float | None, pose: list[str], velocity: list[str], controller: str, gains: str, brake_at: float | None,
    brake: list[str], dry_friction: list[str], bounce: float | None, rate: float | None, method: str, step: float | None, tolerance: float | None,
) -> tuple[Simulated, list[InputFile]]:  # fmt: skip
    """What the options say, and the files of poses."""
    from ksl.load_cases.case_files.simulated import CONTROLLERS, RATE, TOLERANCE, ControllerName, Simulated
    from ksl.simulation.simulate import METHODS

    law = controller.replace("-", " ")
    if law not in CONTROLLERS:
        fail(f"--controller {controller}: expected one of {', '.join(c.replace(' ', '-') for c in CONTROLLERS)}")
    if method not in METHODS:
        fail(f"--method {method}: expected one of {', '.join(METHODS)}")
    if tolerance is not None and not tolerance > 0:
        fail(f"--tolerance {tolerance:g}: expected a number above zero")
    if tolerance is not None and method != "dop853":
        fail(f"--tolerance: {method} controls no error; give --step, or take dop853")
    if brake and brake_at is None:
        fail("--brake: brakes engage at a time; give --brake-at S")
    stiffness, damping = _gains(law, gains)
    is_motion = bool(state) and not state.endswith(".toml")
    there, files = _motion(model, state) if is_motion else (None, [])
    positions, more = _positions(model, [state] if state and not is_motion else pose)
    return Simulated(
        until, start, there, positions, dict(named_number(one, "--velocity", "rad/s or m/s") for one in velocity), cast(ControllerName, law), stiffness, damping, brake_at,
        _efforts(brake, "--brake"), _efforts(dry_friction, "--dry-friction"), bounce, RATE if rate is None else rate, method, step,
        TOLERANCE if tolerance is None else tolerance, TOLERANCE if tolerance is None else tolerance,
    ), [*files, *more]  # fmt: skip


def _motion(model: Model, file: str) -> tuple[Motion, list[InputFile]]:
    from ksl.motions.reading import read_motion

    with recorded() as ledger:
        return read_motion(model, file), ledger.files


def _gains(law: str, gains: str) -> tuple[float, float]:
    if law in ("pd", "computed torque"):
        if not gains:
            fail(f"--controller {law.replace(' ', '-')}: needs --gains STIFFNESS,DAMPING")
        stiffness, damping = numbers(gains, "--gains", 2)
        return stiffness, damping
    if gains and law == "none":
        fail("--gains: are those of a controller; give --controller pd, computed-torque or gravity")
    return 0.0, numbers(gains, "--gains", 1)[0] if gains else 0.0


def _positions(model: Model, pose: list[str]) -> tuple[dict[str, Any] | None, list[InputFile]]:
    from ksl.load_cases.holding import read_pose

    if not pose:
        return None, []
    found: dict[str, Any] = {}
    with recorded() as ledger:
        for one in pose:
            found |= dict([named_number(one, "--pose")]) if "=" in one and not os.path.exists(one) else read_pose(model, one, None)
    return found, ledger.files


def _efforts(given: list[str], option: str) -> float | dict[str, float] | None:
    """One number for all joints, or NAME=VALUE for some."""
    if not given:
        return None
    if len(given) == 1 and "=" not in given[0]:
        return numbers(given[0], option, 1)[0]
    return dict(named_number(one, option, "N m or N") for one in given)


def _case(model: Model, how: Simulated, motion: Path | None, carried: list[Payload]) -> tuple[LoadCase, list[InputFile]]:
    from ksl.load_cases.load_case import LoadCase
    from ksl.load_cases.case_files.simulated import brakes_from, simulated_motion
    from ksl.motions.reading import read_motion

    with recorded() as ledger:
        followed = None if motion is None else read_motion(model, motion)
        with _progress() as progress:
            moved, kind = simulated_motion(model, how, followed, [], progress)
    return LoadCase(
        model, moved, name="simulated", motion_file="" if motion is None else str(motion), payloads=carried, brakes_from=brakes_from(how), kind=kind
    ), ledger.files


@contextmanager
def _progress() -> Iterator[Callable[[float, float], None]]:
    """A bar where a person watches."""
    from rich.progress import Progress

    out = console(120)
    with Progress(console=out, transient=True, disable=not out.is_terminal) as bar:
        task = bar.add_task("simulating", total=1.0)
        yield lambda done, whole: bar.update(task, completed=done / whole)


def _motions(model: Model, cases: list[LoadCase]) -> dict[str, Callable[[Path], None]]:
    """Files of the simulated motions: motion.csv, or motion_1.csv and so on, by the number of the load case."""
    from ksl.motions.generate import write_motion
    from ksl.motions.generate.generated import Generated

    def write(case: LoadCase, path: Path) -> None:
        write_motion(model, Generated(case.motion, facts={"kind": "simulate"}), path)

    simulated = [k for k, case in enumerate(cases, 1) if case.motion.integrated]
    return {"motion.csv" if len(cases) == 1 else f"motion_{k}.csv": partial(write, cases[k - 1]) for k in simulated}
