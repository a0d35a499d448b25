"""The command line.  Imported by ksl.__main__ if the extra `loads` is installed."""

from __future__ import annotations

import math
import os
import signal
import sys
import warnings
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from types import FrameType
from typing import Annotated, Any, Literal, NoReturn, cast

import typer
from rich.console import Console
from typer.core import TyperGroup

from ksl._core import __version__
from ksl.errors import DescriptionWarning
from ksl.loading import load
from ksl.model import Model
from ksl.states import Order, Side


class Commands(TyperGroup):
    """The commands, whose words print on any terminal, and which say it where standard output can't be written."""

    def main(self, *args: Any, **options: Any) -> Any:
        for stream in (sys.stdout, sys.stderr):
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="replace")  # "?" for characters that the encoding lacks, rather than no output
        try:
            try:
                return super().main(*args, **options)
            finally:
                if sys.stdout is not None:  # None if the shell has closed it
                    sys.stdout.flush()  # an error at the end of the interpreter would be Python's to report
        except BrokenPipeError:  # nobody reads what is printed: as any command
            discard_output()
            sys.exit(1)
        except OSError as e:
            if e.filename is not None:  # of a file, and not of standard output
                raise
            errors.print(f"ksl: {unwritable(e)}")
            discard_output()
            sys.exit(2)


app = typer.Typer(cls=Commands, add_completion=False, pretty_exceptions_enable=False, no_args_is_help=True, rich_markup_mode=None, help="Every wrench in a mechanism.")
errors = Console(stderr=True, soft_wrap=True, highlight=False, markup=False)

Robot = Annotated[Path, typer.Argument(metavar="ROBOT", help="Robot file: URDF, SDF, or MJCF (with the package mujoco).")]
FloatingBase = Annotated[bool, typer.Option("--floating-base", help="The root link floats: first joint floating_base.")]
Mimic = Annotated[str, typer.Option(metavar="coupled|independent", help="Joints that mimic another follow it, or have a coordinate of their own.")]
Strict = Annotated[bool, typer.Option("--strict", help="An inertia that no rigid body can have, or a moving link with geometry and no mass, is an error.")]
Gravity = Annotated[str, typer.Option(metavar="X,Y,Z", help="Gravity in world axes, m/s²; otherwise that of the file, or 0,0,-9.81.")]
Physics = Annotated[str, typer.Option("--physics", metavar="NAMES", help="Physics of joints, separated by commas: damping, friction or exact friction, armature, rotor or rotor bodies, spring; or all.")]
FrictionWidth = Annotated[float, typer.Option("--friction-width", metavar="SPEED", help="Where smooth friction has 0.71 of its full strength, rad/s or m/s, for joints without one of their own.")]
ModelName = Annotated[str, typer.Option("--model", metavar="NAME", help="Which model of an SDF file that has several.")]


def console(width: int) -> Console:
    """Standard output; of that width where it is no terminal."""
    out = Console(highlight=False)
    if not out.is_terminal:
        out.width = width
    return out


def fail(sentence: object) -> NoReturn:
    errors.print(f"ksl: {sentence}")
    raise typer.Exit(2)


def unwritable(error: OSError) -> str:
    return f"standard output can't be written ({os.strerror(error.errno) if error.errno else error})"


def discard_output() -> None:
    """Discards what standard output still buffers.  Otherwise Python would try to write it again at exit, and end with status 120."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


def numbers(text: str, option: str, *counts: int) -> list[float]:
    try:
        values = [float(x) for x in text.split(",")]
    except ValueError:
        values = []
    if len(values) not in counts or not all(math.isfinite(x) for x in values):
        fail(f"{option} {text}: expected {' or '.join(str(c) for c in counts)} finite numbers separated by commas")
    return values


def suggestion(name: str, known: list[str], otherwise: str) -> str:
    near = get_close_matches(name, known, 1)
    return f"did you mean {near[0]}?" if near else f"{otherwise} {', '.join(known)}"


def in_options(error: ValueError, **options: object) -> str:
    """What Python says of an argument, said of the option that gave it: `--at hand: expected …`."""
    text = str(error)
    for name, value in options.items():
        argument = f"{name}={value!r}"
        if text.startswith(argument):
            return f"--{name} {value}: {text[len(argument) :].lstrip(':; ')}"
    return text


def end_on_signals() -> None:
    """Makes SIGTERM and SIGHUP leave by SystemExit, so that temporary files are removed."""

    def leave(number: int, _: FrameType | None) -> None:
        signal.signal(number, signal.SIG_IGN)  # once is enough
        sys.exit(128 + number)

    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)  # no SIGHUP on Windows
        if number is not None and signal.getsignal(number) == signal.SIG_DFL:  # nohup ignores SIGHUP
            signal.signal(number, leave)


def read_model(
    robot: Path,
    floating_base: bool,
    mimic: str,
    strict: bool,
    gravity: str,
    payloads: Mapping[str, tuple[float, Sequence[float]]] | None = None,
    masses: Literal["optional"] | None = None,
    name: str = "",
    physics: str = "",
    friction_width: float = 0.01,
) -> Model:
    how = cast(Literal["coupled", "independent"], mimic)  # load refuses other words
    given_gravity = numbers(gravity, "--gravity", 3) if gravity else None
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DescriptionWarning)
        try:
            on = [word.strip() for word in physics.split(",")] if physics else None
            model = load(robot, floating_base, how, strict, given_gravity, payloads, masses, name or None, on, friction_width)
        except ValueError as e:
            absent = [link for link in payloads or {} if f"no link {link} to carry the payload" in str(e)]
            if absent:
                bare = load(robot, floating_base, how, masses="optional", model=name or None)
                fail(f"--on-link {absent[0]}: no such link; {suggestion(absent[0], bare.link_names, f'the links of {bare.name} are')}")
            fail(in_options(e, mimic=mimic))
    for w in caught:
        errors.print(f"ksl: warning: {w.message}")
    return model


@app.callback(invoke_without_command=True)
def root(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    if version:
        print(f"ksl {__version__}")
        raise typer.Exit()


@app.command()
def info(
    robot: Annotated[Path | None, typer.Argument(metavar="ROBOT", help="Robot file: URDF, SDF, or MJCF (with the package mujoco).")] = None,
    floating_base: FloatingBase = False,
    mimic: Mimic = "coupled",
    strict: Strict = False,
    gravity: Gravity = "",
    model_name: ModelName = "",
    physics: Physics = "",
    cpu: Annotated[bool, typer.Option("--cpu", help="Say which instruction set the kernels use here.")] = False,
) -> None:
    """Print a robot's tree, joints, limits, masses, gravity, degrees of freedom, and what its file holds that is not used."""
    from ksl._core import instruction_set
    from ksl.info import print_info

    if cpu:
        try:
            print(f"kernels: {instruction_set()}")
        except RuntimeError as e:
            fail(e)
    elif robot is None:
        fail("info needs a robot file, or --cpu")
    if robot is not None:
        print_info(read_model(robot, floating_base, mimic, strict, gravity, masses="optional", name=model_name, physics=physics), console(200))


@app.command()
def loads(
    robot: Robot,
    motion: Annotated[Path, typer.Argument(metavar="MOTION.csv", help="`time` and a column per moving joint (rad, m); NAME.v, NAME.a if known.")],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Folder for the results.")] = Path("loads"),
    csv: Annotated[bool, typer.Option("--csv", help="Write wrenches.csv beside wrenches.parquet.")] = False,
    on: Annotated[str, typer.Option(metavar="child|parent", help="Side that the wrench acts on.")] = "child",
    at: Annotated[str, typer.Option(metavar="POINT", help="Point of the moments: joint, world, a link's name, or X,Y,Z from the joint's origin in its axes.")] = "joint",
    axes: Annotated[str, typer.Option(metavar="AXES", help="joint, world, or a link's name.")] = "joint",
    order: Annotated[str, typer.Option(metavar="lin_ang|ang_lin", help="Force or moment first.")] = "lin_ang",
    payload: Annotated[list[str], typer.Option(metavar="MASS[,X,Y,Z]", help="Point mass, kg, at a point of the link's frame, m; with --on-link.")] = [],
    on_link: Annotated[list[str], typer.Option(metavar="NAME", help="Link that carries the payload.")] = [],
    external: Annotated[Path | None, typer.Option(metavar="FILE.csv", help="Wrenches on links: `time` and LINK.fx … LINK.tz, at the link's origin, in its axes.")] = None,
    floating_base: FloatingBase = False,
    mimic: Mimic = "coupled",
    strict: Strict = False,
    gravity: Gravity = "",
    model_name: ModelName = "",
    physics: Physics = "",
    friction_width: FrictionWidth = 0.01,
) -> None:
    """Compute the wrench through every joint along a motion and write wrenches.parquet, summary.csv and report.html.

    A floating base has the columns floating_base.x .y .z .qx .qy .qz .qw (pose in the world) and, if its rates are known,
    floating_base.vx .vy .vz .wx .wy .wz and .ax .ay .az .bx .by .bz (twist in the body's frame and its componentwise derivative).

    A spherical joint has the columns NAME.qx .qy .qz .qw (a unit quaternion) and, if known, NAME.wx .wy .wz (angular velocity in
    the child's axes) and NAME.bx .by .bz (its componentwise derivative). docs/loads.md lists those of cylindrical, universal,
    planar and translation joints.
    """
    from ksl.job import run_loads
    from ksl.loads import LoadCase, Placement
    from ksl.motion import read_external, read_motion
    from ksl.output import OutputError

    if len(payload) != len(on_link):
        fail(f"{len(payload)} --payload and {len(on_link)} --on-link; give one --on-link NAME for each --payload MASS[,X,Y,Z]")
    if len(set(on_link)) != len(on_link):
        fail(f"--on-link {max(on_link, key=on_link.count)} is given more than once; a link carries one payload")
    values = [numbers(p, "--payload", 1, 4) for p in payload]
    end_on_signals()
    loaded = {link: (p[0], p[1:] or [0, 0, 0]) for link, p in zip(on_link, values)}
    model = read_model(robot, floating_base, mimic, strict, gravity, loaded, name=model_name, physics=physics, friction_width=friction_width)
    point = numbers(at, "--at", 3) if "," in at else at
    try:
        model._request(on, point, axes, order, "total", [])
    except ValueError as e:
        fail(in_options(e, on=on, at=at, axes=axes, order=order))
    placement = Placement(cast(Side, on), point, axes, cast(Order, order))  # the request was not refused
    try:
        moved = read_motion(model, motion)
        wrenches = read_external(model, external, moved.time) if external else {}
        run_loads(LoadCase(model, moved, placement, wrenches), str(motion), output, csv, console(120))
    except BrokenPipeError:  # nobody reads what is printed: as any command
        raise
    except (ValueError, OutputError, RuntimeError) as e:  # RuntimeError: an unknown KSL_ISA
        fail(e)
    except OSError as e:
        discard_output()
        fail(f"{unwritable(e)}; results are in {output}")
