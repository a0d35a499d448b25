"""`ksl.fmu`: a mechanism as a unit for co-simulation, FMI 3.0."""

from __future__ import annotations

import hashlib
import os
import platform
import sys
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ksl.base.errors import ArgumentError, CompilerError, of_argument
from ksl.generation.arguments import Arguments
from ksl.generation.compiler import VARIABLE, Compiler, find_compiler
from ksl.generation.files import Code
from ksl.generation.fmus.fmu_description import build_description, model_description
from ksl.generation.fmus.fmu_model import FmuModel
from ksl.generation.fmus.fmu_variables import Kind, layout_of, moving_joints
from ksl.generation.open_reactions import Undetermined, refuse_open
from ksl.generation.fmus.open_states import open_states
from ksl.generation.requests import Function, checked_prefix, functions_of
from ksl.output import refuse_inputs, refuse_unknown, staged

if TYPE_CHECKING:
    from ksl.model.model import Model

METHODS = ("rk4", "semi_implicit_euler")
WHAT = {
    "forward": "A mechanism in motion: efforts of its joints are inputs, and positions, velocities, accelerations and reactions follow.",
    "inverse": "A mechanism whose motion is given: positions, velocities and accelerations are inputs, and efforts and reactions follow.",
}
SHARED = tuple(Path(__file__).parent / "fmi3" / file for file in ("fmi3.c", "fmi3_absent.c", "fmi3.h", "fixed_step.h", "closing.h"))
"""Sources that are the same for all mechanisms."""
SYSTEMS = {"linux": ("linux", ".so"), "darwin": ("darwin", ".dylib"), "win32": ("windows", ".dll")}
PROCESSORS = {"x86_64": "x86_64", "AMD64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64", "ARM64": "aarch64"}
ZERO = (1980, 1, 1, 0, 0, 0)
"""The time of all files in the archive, so that it is the same each time."""


def fmu(
    model: Model,
    output: str | os.PathLike[str],
    kind: Kind = "forward",
    name: str = "robot",
    joints: Sequence[str] | None = None,
    method: Literal["rk4", "semi_implicit_euler"] = "rk4",
    step: float = 1e-3,
    undetermined: Undetermined = "refuse",
    compiler: str | None = None,
    force: bool = False,
    scalar: Literal["double", "float"] = "double",
) -> Path:
    """Writes an FMU for co-simulation, FMI 3.0, and returns the path of the file.

    output: FILE.fmu, or a folder, which gets NAME.fmu; made if it is missing.
    kind: "forward", a mechanism in motion: efforts in, positions, velocities, accelerations and reactions out; the initial position and velocity, and the
        longest step of the method, s, are parameters.  "inverse": positions, velocities and accelerations in, efforts and reactions out.
    name: the identifier of the model, and the prefix of its functions in C.
    joints: whose reactions are outputs; None: all that move, []: none.  They are those of :meth:`Model.reactions`: on the child, in its axes, about the joint.
    method, step: those of :meth:`Model.simulate`, whose results a forward FMU in double precision has: to the bit where positions move by addition, otherwise
        to rounding.  Efforts are constant within a communication step, which has a whole number of steps.  A closed mechanism is moved to the nearest closed
        position and velocity after each step; its start must be closed.  Its pivots are fixed: a step that comes where they are too small is discarded.
    undetermined: as in :func:`ksl.generate`.
    compiler: of the binary for this machine: the command of a compiler; None: that of KSL_CC, or clang, gcc or cc, and sources alone where there is none;
        "": sources alone.
    force: whether a file that is no FMU of KSL is replaced.
    scalar: "double", or "float" for the arithmetic of a controller in single precision; variables are Float64 nevertheless, and rounded where they are set.
        Closed mechanisms have no code in "float".

    Variables are scalars with the names of a motion's columns: `elbow`, `elbow.v`, `elbow.a`, `elbow.effort`, `elbow.reaction.fx`, and of a forward FMU
    `elbow.start`, `elbow.v.start` and `step`; SI units, rad.  Where two would have one name, a `_` is added; invisible characters are written as their numbers.
    Raises ArgumentError, CompilerError, OutputError.  O(operations of the algorithms).

        ksl.fmu(m, "arm.fmu", name="arm")
    """
    joints = [joints] if isinstance(joints, str) else joints
    _judge(kind, method, step, undetermined, scalar)
    prefix = checked_prefix(name)
    if prefix.lower() in ("fmu_model", *(path.stem for path in SHARED)):
        raise of_argument(ArgumentError, "name", ": is the name of another source of the FMU; take another", name)
    functions = _functions(model, kind, joints, undetermined, scalar == "float")
    loops = open_states(model, functions[0]) if kind == "forward" and model.loops else None
    if loops is not None:
        functions = [loops.dynamics, loops.equations, *functions[1:]]
    named = [joint.name for joint in moving_joints(model)] if joints is None else list(joints)
    layout = layout_of(model, kind, named, float(step))
    code = Code(model, prefix, scalar, False, functions)
    glue = FmuModel(model, prefix, kind, layout, method, all(f.row != "integrate" for f in functions), scalar, loops, code.first_line())
    texts = {f"{prefix}.h": code.header(), f"{prefix}.c": code.source()} | {path.name: path.read_text(encoding="ascii") for path in SHARED}
    texts["buildDescription.xml"] = build_description(prefix, [file for file in texts if file.endswith(".c")])
    token = _token([*texts.values(), glue.header(""), *(variable.name for variable in layout.variables)])
    texts["fmu_model.h"] = glue.header(token)
    archive: dict[str, bytes] = {
        "modelDescription.xml": model_description(prefix, model.name, WHAT[kind], token, layout, step if kind == "forward" else None).encode()
    }
    archive |= {f"sources/{file}": text.encode() for file, text in texts.items()}
    if (found := _compiler(compiler)) is not None:
        archive |= _binary(found, prefix, texts)
    return _written(model, Path(output), prefix, archive, force)


def _judge(kind: str, method: str, step: float, undetermined: str, scalar: str) -> None:
    if kind not in WHAT:
        raise of_argument(ArgumentError, "kind", f": expected {' or '.join(WHAT)}", kind)
    if method not in METHODS:
        raise of_argument(ArgumentError, "method", f": expected {' or '.join(METHODS)}: methods of m.simulate whose steps are straight code", method)
    if type(step) is bool or not isinstance(step, (int, float)) or not 0 < step < float("inf"):
        raise of_argument(ArgumentError, "step", ": expected a finite time above zero, s", step)
    if undetermined not in ("refuse", "least-norm"):
        raise ArgumentError(f"undetermined={undetermined!r}: expected refuse or least-norm")
    if scalar not in ("double", "float"):
        raise of_argument(ArgumentError, "scalar", ": expected double or float", scalar)
    if scalar == "float" and not 2.0**-126 <= step < 2.0**127:
        raise of_argument(ArgumentError, "step", ": expected a time that single precision has, s", step)


def _functions(model: Model, kind: Kind, joints: Sequence[str] | None, undetermined: Undetermined, single: bool) -> list[Function]:
    """What the FMU calls, dynamics first."""
    asked = ["forward_dynamics"] if kind == "forward" else ["inverse_dynamics"]
    if kind == "forward" and not all(joint.one_coordinate for joint in moving_joints(model)):
        asked.append("integrate")
    if joints is not None and len(set(joints)) < len(joints):
        raise of_argument(ArgumentError, "joints", f": names a joint twice: {', '.join(joints)}; name each once")
    if joints is None or joints:
        asked.append("reactions" if joints is None else f"reactions:{'+'.join(joints)}")
    functions = functions_of(model, asked, Arguments(), single, "least-norm")
    if undetermined == "refuse" and functions[-1].row == "reactions":
        refuse_open(model, "joints: reactions", 'joints=["JOINT"] (--joints JOINT,JOINT)', joints or [joint.name for joint in moving_joints(model)])
    return functions


def _token(texts: Sequence[str]) -> str:
    """Another one for every change of what is computed."""
    return "{" + hashlib.sha256("\0".join(texts).encode()).hexdigest()[:32] + "}"


def _compiler(name: str | None) -> Compiler | None:
    if name == "":
        return None
    try:
        return find_compiler(name)
    except CompilerError:
        if name is not None or os.environ.get(VARIABLE):
            raise
        return None


def _binary(compiler: Compiler, name: str, sources: Mapping[str, str]) -> dict[str, bytes]:
    """The library for this machine; none where FMI has no name for it."""
    if sys.platform not in SYSTEMS or platform.machine() not in PROCESSORS:
        return {}
    system, ending = SYSTEMS[sys.platform]
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        for file, text in sources.items():
            (place / file).write_text(text, encoding="utf-8", newline="\n")
        library = place / f"{name}{ending}"
        compiler.build(sorted(place.glob("*.c")), library, compiler.portable_flags(), "the sources of the FMU")
        return {f"binaries/{PROCESSORS[platform.machine()]}-{system}/{library.name}": library.read_bytes()}


def _written(model: Model, output: Path, name: str, archive: Mapping[str, bytes], force: bool) -> Path:
    file = output if output.suffix == ".fmu" else output / f"{name}.fmu"
    refuse_inputs([file], [given.file for given in model.inputs])
    with staged(file.parent, (), None if force else lambda: _refuse_others(file)) as stage:
        with zipfile.ZipFile(stage / file.name, "w", zipfile.ZIP_DEFLATED) as made:
            for inside, content in archive.items():
                info = zipfile.ZipInfo(inside, ZERO)
                info.compress_type = zipfile.ZIP_DEFLATED
                info.external_attr = (0o755 if inside.startswith("binaries/") else 0o644) << 16
                made.writestr(info, content)
    return file


def _refuse_others(file: Path) -> None:
    """A file of somebody else stays: FMUs of KSL say so."""
    try:
        with zipfile.ZipFile(file) as there, there.open("modelDescription.xml") as description:
            if b'generationTool="KSL ' in description.read(10_000):
                return
    except (OSError, KeyError, zipfile.BadZipFile):
        pass
    refuse_unknown(file.parent, [file.name], f"{file.name} that is an FMU of KSL")
