"""`ksl motion`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ksl.base.words import count
from ksl.commands.app import app, console, fail, say
from ksl.commands.options import Robot, RobotOptions, file_with_a_name, of_robot, read_model

if TYPE_CHECKING:
    from collections.abc import Callable

    from ksl.model.model import Model
    from ksl.motions.generate import Generated

KINDS = ("template", "minjerk", "trapezoid", "chirp", "excite")
OPTIONS = {
    "waypoints": ("minjerk", "trapezoid"),
    "duration": ("minjerk", "trapezoid", "chirp", "excite"),
    "acceleration": ("minjerk", "trapezoid", "chirp", "excite"),
    "rate": ("minjerk", "trapezoid", "chirp", "excite"),
    "from": ("chirp",),
    "to": ("chirp",),
    "seconds": ("excite",),
    "iterations": ("excite",),
    "seed": ("excite",),
}
"""Which kinds take which options."""


@app.command()
@of_robot("gravity")
def motion(
    robot: Robot,
    kind: Annotated[str, typer.Option(metavar="|".join(KINDS), help="What to make; see below.")],
    output: Annotated[Path, typer.Option("--output", "-o", parser=file_with_a_name, metavar="FILE", help="Table to write: .csv or .parquet.")],
    waypoints: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Table of positions, a line for each waypoint, `time` if known; otherwise between the limits.")
    ] = None,
    duration: Annotated[float | None, typer.Option(metavar="S", help="Whole time; otherwise the shortest within the limits (chirp 20 s, excite 10 s).")] = None,
    acceleration: Annotated[float | None, typer.Option(metavar="A", help="Limit of accelerations, rad/s² or m/s², which files don't give.")] = None,
    rate: Annotated[float | None, typer.Option(metavar="HZ", help="Samples a second; 250.")] = None,
    low: Annotated[float | None, typer.Option("--from", metavar="HZ", help="First frequency of a chirp; 0.1.")] = None,
    high: Annotated[float | None, typer.Option("--to", metavar="HZ", help="Last frequency of a chirp; 2.")] = None,
    seconds: Annotated[float | None, typer.Option(metavar="S", help="Time of the search of excite; 20.")] = None,
    iterations: Annotated[int | None, typer.Option(metavar="N", help="Candidates of the search instead of a time: the same motion on every run.")] = None,
    seed: Annotated[int | None, typer.Option(metavar="N", help="Of the search; 0.")] = None,
    how: RobotOptions = RobotOptions(),
    drives_only: Annotated[
        bool, typer.Option("--drives-only", help="Write the columns of the drives alone, of a robot with loops; ksl loads needs no others.")
    ] = False,
) -> None:
    """Make a motion within the limits of the robot's file: of position, speed and effort.

    template: the columns, and one row with the neutral position. minjerk: through waypoints with the least jerk, at rest at both ends.
    trapezoid: from waypoint to waypoint with constant accelerations, stopping at each. chirp: all joints with a rising frequency.
    excite: a periodic motion that identifies inertial parameters well, the best one that a search finds.
    """
    from ksl.output import OutputError, refuse_inputs

    given = {"waypoints": waypoints, "duration": duration, "acceleration": acceleration, "rate": rate, "from": low, "to": high}
    given |= {"seconds": seconds, "iterations": iterations, "seed": seed}
    if kind not in KINDS:
        fail(f"--kind {kind}: expected one of {', '.join(KINDS)}")
    for name, value in given.items():
        if value is not None and kind not in OPTIONS[name]:
            fail(f"--{name} is for {' and '.join(OPTIONS[name])}, not for {kind}; leave it out")
    try:
        refuse_inputs([output], [robot, *([waypoints] if waypoints else [])])
    except OutputError as e:
        fail(e)
    model = read_model(robot, how, masses="optional")
    try:
        made = _made(model, kind, {k: v for k, v in given.items() if v is not None})
        from ksl.motions.generate.writing import write_motion, written_joints

        joints = written_joints(model, made, "drives" if drives_only else "all")
        write_motion(model, made, output, "drives" if drives_only else "all")
    except (ValueError, OSError) as e:  # OutputError is an OSError
        fail(e)
    _print(model, made, output, len(joints))


def _made(model: Model, kind: str, given: dict[str, object]) -> Generated:
    from ksl.motions import generate
    from ksl.motions.generate.generated import limits_of

    named = {{"from": "low", "to": "high"}.get(k, k): v for k, v in given.items()}
    if kind == "template":
        return generate.template(model)
    if kind in ("minjerk", "trapezoid"):
        if "waypoints" in named:
            named["waypoints"] = generate.read_waypoints(model, limits_of(model), str(named["waypoints"]))
        return (generate.minimum_jerk if kind == "minjerk" else generate.trapezoid)(model, **named)  # type: ignore[arg-type]
    if kind == "chirp":
        return generate.chirp(model, **named)  # type: ignore[arg-type]
    if "duration" in named:
        named["period"] = named.pop("duration")
    with _progress() as progress:
        return generate.excitation(model, **named, progress=progress)  # type: ignore[arg-type]


@contextmanager
def _progress() -> Iterator[Callable[[float, float], None]]:
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    out = console(80)
    columns = (TextColumn("search"), BarColumn(), TimeRemainingColumn(), TextColumn("{task.fields[found]}"))
    with Progress(*columns, console=out, transient=True, disable=not out.is_terminal) as bar:
        task = bar.add_task("search", total=1.0, found="")
        yield lambda share, smallest: bar.update(task, completed=share, found=f"condition number {smallest:.4g}")


def _print(model: Model, made: Generated, output: Path, joints: int) -> None:
    out = console(80)
    from ksl.commands.print_notes import print_notes, print_unused
    from ksl.motions.generate.generated import beyond_limits

    print_notes(out, [*made.notes, *beyond_limits(model, made.motion)])
    print_unused(out, model)
    f, t = made.facts, made.motion.time
    if f["kind"] == "excite":
        say(
            out,
            f"condition number {f['condition']:.4g} of the regressor of {f['parameters']} base parameters, the best of {f['iterations']} motions "
            f"with seed {f['seed']}; {f['first']:.4g} the best of the first, random ones",
        )
    samples = "1 sample" if len(t) == 1 else f"{len(t)} samples, {t[-1]:.6g} s"
    say(out, f"written to {output}: {samples}, {count(joints, 'joint')}")
