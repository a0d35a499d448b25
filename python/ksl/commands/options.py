"""Options that several commands share, and the model that they describe."""

from __future__ import annotations

import functools
import inspect
import math
import os
import shlex
import warnings
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, cast, get_type_hints

import typer

from ksl.commands.app import errors, fail

if TYPE_CHECKING:
    from ksl.load_cases.load_case import Payload
    from ksl.model.model import Model

Decorator = Callable[[Callable[..., None]], Callable[..., None]]
Robot = Annotated[Path, typer.Argument(metavar="ROBOT", help="Robot file: URDF, SDF, MJCF (with the package mujoco) or USD (with usd-core).")]
RobotText = Annotated[Path, typer.Argument(metavar="ROBOT", help="Robot file: URDF, SDF, or MJCF (with the package mujoco).")]
"""The robot of commands that read the file themselves, or have others read it."""
FloatingBase = Annotated[bool, typer.Option("--floating-base", help="The root link floats: first joint floating_base.")]
Mimic = Annotated[str, typer.Option(metavar="coupled|independent", help="Joints that mimic another follow it, or have a coordinate of their own.")]
Strict = Annotated[bool, typer.Option("--strict", help="An inertia that no rigid body can have, or a moving link with geometry and no mass, is an error.")]
Gravity = Annotated[str, typer.Option(metavar="X,Y,Z", help="Gravity in world axes, m/s²; otherwise that of the file, or 0,0,-9.81.")]
Physics = Annotated[
    str,
    typer.Option(
        "--physics",
        metavar="NAMES",
        help="Physics of joints, separated by commas: damping, friction or exact friction, armature, rotor or rotor bodies, spring, force elements; or all.",
    ),
]
FrictionWidth = Annotated[
    float,
    typer.Option(
        "--friction-width", metavar="SPEED", help="Where smooth friction has 0.71 of its full strength, rad/s or m/s, for joints without one of their own."
    ),
]
ModelName = Annotated[str, typer.Option("--model", metavar="NAME", help="Which model of an SDF file that has several.")]
Loops = Annotated[
    str, typer.Option("--loops", metavar="FILE.toml|cut", help="Joints that close loops, in a file beside the robot's; or leave those of the robot's file out.")
]
Drives = Annotated[str, typer.Option("--drives", metavar="NAMES", help="The joints that have motors, of a robot with loops, separated by commas.")]
Xacro = Annotated[
    str | None,
    typer.Option(
        "--xacro",
        metavar="'NAME:=VALUE …'",
        help="ROBOT is a xacro file, which is run with these arguments, '' for none. It is a program: run those of people you trust.",
    ),
]
Packages = Annotated[
    list[str],
    typer.Option(
        "--package",
        metavar="NAME=DIR",
        help="With --xacro: the folder of a package that the file finds, $(find NAME); may be repeated. Others are looked for in the folders above it, and where ROS has them.",
    ),
]
FIXED = {
    "compare": {"mimic": "independent: other libraries have it so", "loops": "cut: other libraries have trees", "drives": "each joint of a tree has one"},
    "sweep": dict.fromkeys(("floating_base", "mimic", "strict", "model_name", "loops", "drives"), "a key of [base] in SWEEP.toml"),
}
"""{command: {option that it doesn't take: how the file is read there}}."""


@dataclass(frozen=True)
class RobotOptions:
    """What commands are told of a robot: how its file is read, and what is computed with it.  A command whose argument `how` is one has these options."""

    floating_base: FloatingBase = False
    mimic: Mimic = "coupled"
    strict: Strict = False
    gravity: Gravity = ""
    model_name: ModelName = ""
    physics: Physics = ""
    friction_width: FrictionWidth = 0.01
    loops: Loops = ""
    drives: Drives = ""
    xacro: Xacro = None
    package: Packages = field(default_factory=list)

    @property
    def motors(self) -> list[str] | None:
        return _words(self.drives)

    @property
    def physics_named(self) -> list[str] | None:
        return _words(self.physics)


COMPUTED = ("gravity", "physics", "friction_width")
"""Options of a robot that say what is computed, and not how its file is read."""
OF_READING = {name: hint for name, hint in get_type_hints(RobotOptions, include_extras=True).items() if name not in COMPUTED}
"""Options that say how a robot's file is read.  Every command that reads one takes them, but for those of `FIXED`."""


def of_robot(*computed: str, without: Collection[str] = ()) -> Decorator:
    """A command with the options of RobotOptions in the place of its argument `how`: of those that say what is computed only these; and without some of the others."""
    return with_options(
        "how", RobotOptions, [each.name for each in fields(RobotOptions) if each.name not in without and (each.name not in COMPUTED or each.name in computed)]
    )


def with_options(argument: str, record: type, names: Sequence[str]) -> Decorator:
    """A command with options in the place of an argument that is a record: these of its fields."""
    hints, defaults = get_type_hints(record, include_extras=True), record()

    def decorated(command: Callable[..., None]) -> Callable[..., None]:
        own = inspect.signature(command, eval_str=True)
        options = [inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=getattr(defaults, name), annotation=hints[name]) for name in names]
        parameters = [each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in own.parameters.values() for each in (options if p.name == argument else [p])]

        @functools.wraps(command)
        def called(**given: Any) -> None:
            command(**{argument: record(**{name: given.pop(name) for name in names})}, **given)

        called.__signature__ = own.replace(parameters=parameters)  # type: ignore[attr-defined]
        called.__annotations__ = {p.name: p.annotation for p in parameters}
        return called

    return decorated


def _words(text: str) -> list[str] | None:
    return [word.strip() for word in text.split(",")] if text else None


PointMasses = Annotated[list[str], typer.Option("--payload", metavar="MASS[,X,Y,Z]", help="Point mass, kg, at a point of the link's frame, m; with --on-link.")]
OnLinks = Annotated[list[str], typer.Option("--on-link", metavar="NAME", help="Link that carries the payload.")]
OnSide = Annotated[str, typer.Option("--on", metavar="child|parent", help="Side that the wrench acts on.")]
AxesOf = Annotated[str, typer.Option("--axes", metavar="AXES", help="joint, world, or a link's name.")]
OrderOf = Annotated[str, typer.Option("--order", metavar="lin_ang|ang_lin", help="Force or moment first.")]
DEFAULT_FRICTION_WIDTH = 0.01
"""rad/s or m/s, as that of ksl.load."""


def path_with_a_name(path: str | Path) -> Path:
    """For what is written: an empty name, as of a shell variable that isn't set, would be the current folder."""
    if not str(path):
        fail("--output: the name is empty; give one, or . for the current folder")
    return Path(path)


Folder = Annotated[Path, typer.Option("--output", "-o", parser=path_with_a_name, metavar="DIR", help="Folder for the results.")]
WriteCsv = Annotated[bool, typer.Option("--csv", help="Write wrenches.csv beside wrenches.parquet.")]
WriteXlsx = Annotated[bool, typer.Option("--xlsx", help="Write results.xlsx, a workbook with a sheet for each table.")]
WriteMcap = Annotated[bool, typer.Option("--mcap", help="Write wrenches.mcap, messages of ROS 2 for Foxglove, PlotJuggler and RViz.")]
WriteMat = Annotated[bool, typer.Option("--mat", help="Write wrenches.mat, for MATLAB and Octave.")]
WriteRrd = Annotated[bool, typer.Option("--rrd", help="Write wrenches.rrd, a recording for Rerun.")]
WriteJson = Annotated[bool, typer.Option("--json", help="Write report.json, everything that the report says in numbers.")]
WritePdf = Annotated[bool, typer.Option("--pdf", help="Write report.pdf, printed by Chromium or Chrome.")]
Components = Annotated[
    Path | None, typer.Option("--components", metavar="FILE.toml", help="Components that the report checks against the loads; see ksl size.")
]
Replace = Annotated[bool, typer.Option("--force", help="Replace results of another robot in DIR, or files of others with their names.")]


def file_with_a_name(path: str | Path) -> Path:
    """A file that is written: no empty name, and none that ends as the name of a folder does."""
    if str(path).endswith(("/", os.sep)):
        fail(f"--output {path}: is the name of a folder; give that of a file")
    return path_with_a_name(path)


def results_with_a_name(path: str | Path) -> Path:
    """For results that are read: an empty name would be those in the current folder."""
    if not str(path):
        fail("the name of the results is empty; give their folder, or . for the current one")
    return Path(path)


def check_order(robot: Path, motion: Path) -> None:
    """Fails where the robot's file and the motion's were given in the wrong order."""
    from ksl.motions.files.recognise import swapped

    if swapped(robot, motion):
        fail(f"{robot} is no robot file, but {motion} is: the robot comes first, then the motion")


def numbers(text: str, option: str, *counts: int) -> list[float]:
    try:
        values = [float(x) for x in text.split(",")]
    except ValueError:
        values = []
    if len(values) not in counts or not all(math.isfinite(x) for x in values):
        fail(f"{option}{'' if option.endswith('=') else ' '}{text}: expected {' or '.join(str(c) for c in counts)} finite numbers separated by commas")
    return values


def named_number(text: str, option: str, units: str = "rad or m, or as 90deg") -> tuple[str, float]:
    """NAME=VALUE.  The value may be in degrees, with `deg` behind it, where the units say so."""
    name, _, value = text.rpartition("=")
    in_degrees = value.endswith("deg") and "deg" in units
    try:
        number = float(value.removesuffix("deg") if in_degrees else value)
    except ValueError:
        number = math.nan
    if not name or not math.isfinite(number):
        fail(f"{option} {text}: expected NAME=VALUE with a number, {units}")
    return name, math.radians(number) if in_degrees else number


def payloads_given(payload: list[str], on_link: list[str]) -> dict[str, tuple[float, list[float]]]:
    """{link: (mass, point)} of the options --payload and --on-link, which come in pairs."""
    if len(payload) != len(on_link):
        fail(f"{len(payload)} --payload and {len(on_link)} --on-link; give one --on-link NAME for each --payload MASS[,X,Y,Z]")
    values = [numbers(p, "--payload", 1, 4) for p in payload]
    return {link: (p[0], p[1:] or [0.0, 0.0, 0.0]) for link, p in zip(on_link, values)}


def carried_payloads(model: Model, loaded: Mapping[str, tuple[float, Sequence[float]]]) -> list[Payload]:
    """The payloads that :func:`payloads_given` returns, of the model, as load cases record them."""
    from ksl.load_cases.load_case import Payload

    return [Payload(model.link(link).name, kilograms, (x, y, z)) for link, (kilograms, (x, y, z)) in loaded.items()]


def xacro_arguments(text: str | None, package: list[str]) -> Mapping[str, object] | None:
    """{name: value} of the option --xacro, with the folders of --package; None without it."""
    from ksl.robot_files.xacro_files import with_packages

    if text is None and package:
        fail(f"--package {package[0]}: is for --xacro, which is not given; add --xacro '' for a xacro file")
    if text is None:
        return None
    found: dict[str, str] = {}
    try:
        words = shlex.split(text)
    except ValueError:
        fail(f"--xacro {text}: a quote has no end")
    for word in words:
        name, sign, value = word.partition(":=")
        if not sign or not name:
            fail(f"--xacro {text}: {word!r} is no argument; expected NAME:=VALUE, separated by blanks")
        found[name] = value
    folders = {}
    for given in package:
        name, sign, folder = given.partition("=")
        if not sign or not name or not os.path.isdir(folder):
            fail(f"--package {given}: expected NAME=DIR, a package and its folder, which exists")
        folders[name] = folder
    return with_packages(found, folders)


def suggestion(name: str, known: list[str], otherwise: str) -> str:
    from ksl.base.errors import close_names

    near = close_names(name, known, 1)
    return f"did you mean {near[0]}?" if near else f"{otherwise} {', '.join(known)}"


def in_options(error: Exception, **options: object) -> str:
    """What Python says of an argument, said of the option that gave it: `--at hand: expected …`."""
    name = getattr(error, "argument", "")
    value = options.get(name)
    if name not in options or getattr(error, "shown", "") not in ("", repr(value)):
        return str(error)
    option, rest = f"--{name.replace('_', '-')}", str(getattr(error, "rest", ""))
    return f"{option} {value}: {rest.lstrip(':; ')}" if getattr(error, "shown", "") else f"{option}{rest}"


@contextmanager
def described_warnings() -> Iterator[None]:
    """Prints warnings about robots, and about options, as sentences of the command."""
    from ksl.base.errors import DescriptionWarning

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DescriptionWarning)
        yield
    for line in dict.fromkeys(str(w.message) for w in caught):
        errors.print(f"ksl: warning: {line}")


def read_model(
    robot: Path, how: RobotOptions, payloads: Mapping[str, tuple[float, Sequence[float]]] | None = None, masses: Literal["optional"] | None = None
) -> Model:
    from ksl.robot_files.loading import load

    if (robot / "wrenches.parquet").is_file():
        fail(f"{robot}: holds results of `ksl loads`, and no robot; the robot's file comes first, then the results or the motion")
    mimic = cast(Literal["coupled", "independent"], how.mimic)  # load refuses other words
    gravity = numbers(how.gravity, "--gravity", 3) if how.gravity else None
    arguments = xacro_arguments(how.xacro, how.package)
    of_file: dict[str, Any] = {"floating_base": how.floating_base, "mimic": mimic, "model": how.model_name or None, "xacro": arguments}
    with described_warnings():
        try:
            model = load(
                robot, **of_file, strict=how.strict, gravity=gravity, payloads=payloads, masses=masses, physics=how.physics_named, friction_width=how.friction_width,
                loops=how.loops or None, drives=how.motors,
            )  # fmt: skip
        except ValueError as e:
            from ksl.mechanism.core_sentences import lacks_link_of_payload

            absent = [link for link in payloads or {} if lacks_link_of_payload(e, link)]
            if absent:
                bare = load(robot, **of_file, masses="optional")
                fail(f"--on-link {absent[0]}: no such link; {suggestion(absent[0], bare.link_names, f'the links of {bare.name} are')}")
            fail(in_options(e, mimic=how.mimic))
    if how.friction_width != DEFAULT_FRICTION_WIDTH and not {"friction", "all"} & set(model.physics):
        why = "exact friction has none" if "exact friction" in model.physics else "--physics names no friction; add friction there"
        errors.print(f"ksl: warning: --friction-width {how.friction_width:g} has no effect: {why}")
    return model
