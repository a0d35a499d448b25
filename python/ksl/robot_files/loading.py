"""Models from robot files, or from their contents: the reader that the root element asks for."""

from __future__ import annotations

import math
import os
import re
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from io import BytesIO
from typing import Literal
from xml.etree import ElementTree

from ksl import _core
from ksl.base import input_files, limits
from ksl.base.errors import DescriptionError, DescriptionWarning
from ksl.base.files_read import InputFile
from ksl.base.input_files import path_given
from ksl.mechanism import given
from ksl.mechanism.core_sentences import asks_for_xacro
from ksl.mechanism.lengths import extent, far, far_point, strong_gravity
from ksl.robot_files.loops_file import LoopsFile
from ksl.model.model import Model, hashed, layout_of
from ksl.mechanism.requests import core_of
from ksl.robot_files.read_options import ReadOptions, path_of_loops
from ksl.robot_files.xacro_files import expanded, with_packages


def load(
    path: str | bytes | os.PathLike[str] | os.PathLike[bytes],
    floating_base: bool = False,
    mimic: Literal["coupled", "independent"] = "coupled",
    strict: bool = False,
    gravity: Sequence[float] | None = None,
    payloads: Mapping[str, tuple[float, Sequence[float]]] | None = None,
    masses: Literal["optional"] | None = None,
    model: str | None = None,
    physics: str | Iterable[str] | None = None,
    friction_width: float = 0.01,
    loops: str | os.PathLike[str] | None = None,
    drives: given.Drives | None = None,
    xacro: Mapping[str, object] | None = None,
    packages: Mapping[str, str | os.PathLike[str]] | None = None,
) -> Model:
    """Reads a robot file: URDF, SDF, MJCF, which needs the extra `ksl[mjcf]`, or USD, which needs `ksl[usd]`.  Its content says which it is.

    floating_base: the root link floats; the first joint is then `floating_base` (`floating_root`, with a warning, if the
    file has a joint of that name).  SDF, MJCF and USD files say themselves what floats: there it is an error if nothing does.
    mimic: a joint that mimics another is "coupled" to it: it has no numbers in q and v, and its position is multiplier ×
    the other's + offset; "independent" gives it a coordinate of its own.
    strict: an inertia that no rigid body can have, or a moving link with geometry and no mass, is an error instead of a
    :class:`DescriptionWarning`.
    gravity: in world axes, m/s²; None is that of an SDF or MJCF file that gives one, and (0, 0, −9.81) otherwise.
    payloads: {link name: (mass in kg, point in the link's frame in m)}: point masses fixed to links.
    masses: None refuses a robot none of whose moving links has a mass; "optional" accepts it, for kinematics.
    model: which model of an SDF file that has several; None is the only one that is not static.
    physics, friction_width: which physics of joints the model has, as :meth:`Model.with_physics` takes them; none by default.
    loops: a TOML file with joints that close loops and with force elements, besides those of the robot file (:mod:`ksl.robot_files.loops_file` shows one); "cut" leaves out
    those of the robot file: the tree, which is another machine.
    drives: the joints that have a motor, of a robot with loops, instead of those that the files name; {joint: weight} as :meth:`Model.with_drives`
    takes it.
    xacro: arguments {name: value} of a xacro file, {} for none, which the package xacro (`ksl[xacro]`) then runs.  Such a file is a program, which reads
    other files and the environment: without this argument it is refused.  Messages name lines of the text that it makes.
    packages: {name: folder} of packages that a xacro file finds; others are looked for in the folders above it, and where ROS has them.
    Raises :class:`DescriptionError`, which names file, line, link or joint, what is wrong and how to mend it.

        m = ksl.load("robot.urdf", payloads={"tool0": (2.0, (0, 0, 0.05))})   # 2 kg, 5 cm in front of the flange
    """
    try:
        file = path_given(path, "a robot file")
        os.fsencode(file)
    except UnicodeEncodeError:
        said = f"{path!a} is no path, since no bytes stand for one of its characters; correct it"
        raise DescriptionError(said) from None
    if "<" in file and ">" in file:
        raise DescriptionError("the path of the file is the contents of one; ksl.load_string(text) reads these")
    options = ReadOptions(floating_base, mimic, strict, gravity, payloads, masses, model, physics, friction_width, loops, drives)
    asked = with_packages(xacro, packages)
    if asked is None:
        loaded = _not_expanded(file, options)
    else:
        made = expanded(file, asked)
        for line in made.said:
            warnings.warn(line, DescriptionWarning, stacklevel=2)
        text = _loaded(made.name, made.contents, options)
        loaded = _as(text, core_of(text), *made.inputs)
    _warn_of(loaded, options)
    return loaded


def load_string(
    text: str | bytes,
    floating_base: bool = False,
    mimic: Literal["coupled", "independent"] = "coupled",
    strict: bool = False,
    gravity: Sequence[float] | None = None,
    payloads: Mapping[str, tuple[float, Sequence[float]]] | None = None,
    masses: Literal["optional"] | None = None,
    model: str | None = None,
    physics: str | Iterable[str] | None = None,
    friction_width: float = 0.01,
    loops: str | os.PathLike[str] | None = None,
    drives: given.Drives | None = None,
) -> Model:
    """Reads the contents of a robot file, for example what a xacro program printed, as :func:`load` reads the file.

    text: the contents; the encoding of bytes is found out.  Messages call it `<string>`, and name its lines.  Meshes of an MJCF text are
    looked for in the current folder.  The other arguments, and errors, are those of :func:`load`.  A pickle of the model contains all
    that it is made of.

        m = ksl.load_string(open("robot.urdf").read())
    """
    if not isinstance(text, (str, bytes)):
        raise ValueError(f"text is {type(text).__name__}; expected the contents of a robot file; ksl.load(path) reads a file")
    contents = text.encode("utf-8", "replace") if isinstance(text, str) else text
    if b"<" not in contents and not contents.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise DescriptionError(f"text {text[:60]!r} holds no XML; expected the contents of a robot file; ksl.load(path) reads a file")
    options = ReadOptions(floating_base, mimic, strict, gravity, payloads, masses, model, physics, friction_width, loops, drives)
    loaded = _loaded("<string>", contents, options)
    _warn_of(loaded, options)
    return loaded


def _not_expanded(file: str, options: ReadOptions) -> Model:
    """From a file that is no xacro.  A refusal of one that is says how KSL would run it."""
    try:
        return _loaded(file, None, options)
    except DescriptionError as e:
        if asks_for_xacro(e):
            raise DescriptionError(f"{e}, or let KSL run it: xacro={{}} (--xacro '')") from None
        raise


def _loaded(file: str, text: bytes | None, options: ReadOptions) -> Model:
    """From a file, or from its contents, which messages then call by this name."""
    beside = None if options.beside is None else LoopsFile(options.beside)
    return _closed(_read(file, text, options), beside, options.drives)


def with_loops(loaded: Model, file: str | os.PathLike[str]) -> Model:
    """A robot with the joints that close loops, and the drives, of a TOML file, besides its own.  Raises :class:`DescriptionError`."""
    made = _closed(loaded, LoopsFile(path_of_loops(file)), None)
    for line in _far_frames(made):
        warnings.warn(line, DescriptionWarning, stacklevel=2)
    return made


def _closed(loaded: Model, beside: LoopsFile | None, drives: given.Drives | None) -> Model:
    """With the loops of a file beside that of the robot, and with drives.  A model that neither changes is the same."""
    if beside is not None:
        beside.check_robot(loaded.name)
        try:
            loaded = _as(loaded, core_of(loaded).with_loops(beside.loops, beside.force_elements), beside.input)
            if beside.drives is not None:
                loaded = _as(loaded, core_of(loaded.with_drives(beside.drives)))
        except ValueError as error:
            raise beside.refused(error) from None
    if drives is None:
        return loaded
    if not loaded.loops:
        raise DescriptionError(f"{loaded.file}: drives are given, but the robot has no loops: each joint of a tree has a motor; leave drives= out")
    return _as(loaded, core_of(loaded.with_drives(drives)))


def _as(loaded: Model, core: _core.Model, *inputs: InputFile) -> Model:
    """Another mechanism of the same files.  Its pickle contains all that it is made of."""
    return Model(core, layout=layout_of(loaded), inputs=(*loaded.inputs, *inputs), payloads=loaded.payloads)


def _read(file: str, text: bytes | None, options: ReadOptions) -> Model:
    """With the loops of the file, unless they are cut."""
    if text is None and _is_usd(file):
        from ksl.robot_files.usd.load_usd import load_usd

        return _of_one_model(load_usd, options, file)
    contents = _core.file_bytes(os.fsencode(file)) if text is None else text
    if root_element(contents) == "mujoco":
        from ksl.robot_files import load_mjcf as mjcf

        return _of_one_model(mjcf._load, options, file, text, contents)
    of_core = options.of_core()
    made = _core.load_text(contents, os.fsencode(file), *of_core)
    if text is not None:
        return Model(made, payloads=options.carried)
    return Model(made, (os.path.abspath(file), *of_core), inputs=hashed(file, contents), payloads=options.carried)


def _of_one_model(reader: Callable[..., Model], options: ReadOptions, file: str, *contents: bytes | None) -> Model:
    """By a reader of a format whose files hold one model; physics are added to what it makes."""
    if options.model:
        raise DescriptionError(f'{file}: model "{options.model}" is asked for, but only SDF files hold several; leave that option out')
    made = reader(file, *contents, options)
    names, width = options.physics_named
    return made.with_physics(names, width) if names or width != made.friction_width else made


def _is_usd(file: str) -> bool:
    """Whether a file begins as USD does, or is a package of it, which is told by its name: it begins as any zip archive."""
    if not os.path.isfile(file):
        return False  # a pipe is read once
    try:
        with input_files.opened(file, limits.USD_BYTES) as source:
            head = source.read(8)
    except input_files.Unreadable:
        return False  # the reader of other formats says so
    return head.startswith((b"#usda", b"PXR-USDC")) or (head.startswith(b"PK\x03\x04") and file.lower().endswith(".usdz"))


def _warn_of(loaded: Model, options: ReadOptions) -> None:
    """Warns of what the file contains, and of lengths of options that are likely in millimetres."""
    reach = extent(loaded, [(*body, 0.0) for body in options.points]) if options.points else 0.0
    doubts = [line for link, _, point in options.points for line in far_point(f"the payload on {link} is", point, reach)]
    doubts += [] if options.loops is None else _far_frames(loaded)
    for line in (*loaded.warnings, *doubts, *([] if options.numbers_of_gravity is None else strong_gravity(options.numbers_of_gravity))):
        warnings.warn(line, DescriptionWarning, stacklevel=3)


def _far_frames(loaded: Model) -> list[str]:
    """Sentences about lengths of joints that close loops and of force elements, which are likely in millimetres."""
    reach, found = extent(loaded) if loaded.loops or loaded.force_elements else 0.0, []
    for loop in loaded.loops:
        for side, pose in ((loop.predecessor, loop.predecessor_pose), (loop.successor, loop.successor_pose)):
            found += far_point(f"the frame of loop joint {loop.name} on {side} is", pose[3:12:4], reach)
        found += far(f"the travel of loop joint {loop.name} in a turn is", abs(2 * math.pi * loop.pitch), reach)
    for element in loaded.force_elements:
        for link, point in ((element.link1, element.point1), (element.link2, element.point2)):
            found += far_point(f"the end of force element {element.name} on {link} is", point, reach)
        for what, length in (("free length", element.free_length), ("lower limit", element.lower), ("upper limit", element.upper)):
            found += [] if length is None else far(f"the {what} of force element {element.name} is", length, reach)
    return found


def root_element(contents: bytes) -> str | None:
    """The name of a file's first element; None if it can't be read, which the reader then explains."""
    # a parser that is given its input in blocks may look at a tag of many megabytes again with each of them
    most = 1 << 20
    name = _first_element(contents[:most])
    if name is None and len(contents) > most:
        before = re.match(rb"(?:\s|<!--.*?-->|<\?.*?\?>)*", contents, re.DOTALL)
        start = before.end() if before else 0
        name = _first_element(contents[start : start + most])
    return name


def _first_element(xml: bytes) -> str | None:
    try:
        return next((element.tag for _, element in ElementTree.iterparse(BytesIO(xml), events=("start",))), None)
    except (ElementTree.ParseError, ValueError, LookupError):
        return None
