"""USD files, read through the package `usd-core`: rigid bodies and joints of UsdPhysics."""

from __future__ import annotations

import hashlib
import os
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ksl.base.errors import DescriptionError
from ksl.base.files_read import InputFile, note
from ksl.base.judged import OutOfBounds
from ksl.base.printable import sentence
from ksl.base.words import listed
from ksl.robot_files.assembly import Body, Connection, assembled, gap, in_double
from ksl.model.builder import Builder, core_of_builder
from ksl.mechanism.core_sentences import with_file
from ksl.model.model import Model
from ksl.robot_files.read_options import ReadOptions
from ksl.robot_files.usd.couplings import require_in_tree

if TYPE_CHECKING:
    from ksl.robot_files.usd.stage import Stage

APART, TURNED = 1e-4, 1e-3
"""m, and the sine of an angle: bodies that stand further from what their joint allows are said.  Single precision leaves some 1e-6."""
MOST_SAID = 20
"""Lines of USD's own that are passed on."""


def load_usd(file: str, options: ReadOptions) -> Model:
    """The robot of a stage.  Raises DescriptionError."""
    try:
        from pxr import Usd
    except ModuleNotFoundError as e:
        if e.name != "pxr":
            raise
        raise DescriptionError(f"{file}: this is USD, which is read by the package usd-core; install it with: pip install 'ksl[usd]'") from None
    try:
        with _Trap() as trap:
            try:
                stage = Usd.Stage.Open(file)
            except Exception as e:  # errors of Tf, which are of several types
                raise DescriptionError(f"USD refuses the file: {_said(e, 500)}; correct it, or write it again") from None
            _require_whole(stage)
            read = _read(stage, options.mimic_independent, trap)
        return _model(file, read, options)
    except ValueError as e:
        raise DescriptionError(with_file(file, e)) from None


class _Trap:
    """Keeps what USD would print on standard error meanwhile; where its Python can't do that, before 25.5, USD prints it."""

    def __enter__(self) -> _Trap:
        from pxr import Tf

        self.trap = Tf.DiagnosticTrap() if hasattr(Tf, "DiagnosticTrap") else None
        self.kept: Any = None if self.trap is None else self.trap.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        if self.trap is not None:
            self.kept.Clear()
            self.trap.__exit__(None, None, None)

    def lines(self) -> list[str]:
        """Its messages so far, without repetitions."""
        if self.trap is None:
            return []
        found = [*self.kept.GetErrors(), *self.kept.GetWarnings()]
        return list(dict.fromkeys(_one_line(str(getattr(d, "commentary", d)), 300) for d in found))


def _require_whole(stage: Any) -> None:
    """USD goes on without the layers, references and payloads that it can't open.  What they hold may be half of the machine."""
    errors = stage.GetCompositionErrors()
    if errors:
        more = f" ({len(errors)} in all)" if len(errors) > 1 else ""
        said = _one_line(str(errors[0]), 500).rstrip(".")
        raise DescriptionError(
            f"a part of the stage is missing: {said}{more}; give that file or prim, or remove what names it: without it the machine may be another one"
        )


@dataclass
class _Machine:
    """What a stage says."""

    stage: Stage
    gravity: list[float]
    bodies: list[Body]
    connections: list[Connection]
    driven: list[str]
    """Names of joints that have drives."""


def _model(file: str, read: _Machine, options: ReadOptions) -> Model:
    stage, bodies, connections = read.stage, read.bodies, read.connections
    if not bodies:
        raise DescriptionError("no rigid body (PhysicsRigidBodyAPI) is in the file: it has shapes alone, or its physics are in another layer; give that file")
    in_double(bodies, connections)
    builder = Builder(stage.name or os.path.splitext(os.path.basename(file))[0] or "robot", gravity=read.gravity)
    made = assembled(builder, bodies, connections, options.cut_loops)
    if not options.cut_loops:
        require_in_tree(connections, made.loops)
    if options.floating_base and not made.floating:
        raise DescriptionError("a floating base is asked for, but joints connect all bodies to the world; remove that joint, or don't ask for it")
    if made.loops and not options.cut_loops:
        _say_loops(made.loops, connections, stage.said)
        drives = [name for name in read.driven if name not in made.loops]
        if drives:
            core_of_builder(builder).set_drives(drives, [])
    _say_gaps(connections, bodies, stage.said)
    if made.turned:
        stage.said.append(
            f"joint {listed(made.turned)}: body1 carries body0; the axis points the other way, so that the position is that of the file (the opposite, of spherical and translation joints)"
        )
    core_of_builder(builder).read_from(file, stage.unused, stage.said)
    core = core_of_builder(builder).build(False, *options.of_builder())
    return Model(core, inputs=_inputs(file, stage.stage), payloads=options.carried)


def _read(opened: object, independent: bool, trap: _Trap) -> _Machine:
    """What a stage says.  Raises ValueError for values that USD lets a file have and that make no sense."""
    from ksl.robot_files.usd.couplings import couple
    from ksl.robot_files.usd.joints import joints_of
    from ksl.robot_files.usd.masses import bodies_of
    from ksl.robot_files.usd.stage import gravity_of, require_values, units_of
    from ksl.robot_files.usd.unused import list_unused

    try:
        stage = units_of(opened)
        require_values(stage)
        bodies = bodies_of(stage)
        joints, driven = joints_of(stage, bodies)
        followers = couple(stage, bodies, joints, independent)
        list_unused(stage)
        gravity = [float(x) for x in gravity_of(stage)]
        lines = trap.lines()
        stage.said += [f"USD says: {line}" for line in lines[:MOST_SAID]] + (
            [f"USD says {len(lines) - MOST_SAID} lines more"] if len(lines) > MOST_SAID else []
        )
        return _Machine(stage, gravity, list(bodies.values()), list(joints.values()), [name for name in driven if name not in followers])
    except (DescriptionError, OutOfBounds, MemoryError):
        raise
    except Exception as e:  # values of types that an attribute can't have, and what USD finds late
        said = f"USD can't make sense of the file ({type(e).__name__}: {_said(e, 300)}); correct it, or write it again"
        raise DescriptionError(said) from None


def _one_line(text: str, most: int) -> str:
    """What USD says, without line breaks and addresses of objects, which differ from run to run."""
    return sentence(re.sub(r" <0x[0-9a-f]+>|anon:0x[0-9a-f]+:", "", " ".join(text.split())))[:most]


def _said(error: Exception, most: int) -> str:
    """What an error of USD says, on one line."""
    try:
        return _one_line(str(error), most)
    except UnicodeDecodeError:  # errors of Tf quote the bytes of the file
        return "it holds bytes that are no UTF-8"


def _say_loops(loops: list[str], connections: list[Connection], said: list[str]) -> None:
    """Joints that close loops though the file doesn't exclude them from the articulation."""
    other = [c.name for c in connections if c.name in loops and not c.closes]
    if other:
        said.append(f"joint {listed(other)}: closes a loop, and excludeFromArticulation doesn't say so; the tree is made of the joints before it")


def _say_gaps(connections: list[Connection], bodies: list[Body], said: list[str]) -> None:
    for c in connections:
        apart, turned = gap(c, bodies)
        if apart > APART or turned > TURNED:
            said.append(
                f"joint {c.name}: its bodies stand where it doesn't let them: its frames are {apart:.3g} m and {turned:.3g} rad apart; those of the joint count, not the poses of the bodies"
            )


def _inputs(file: str, stage: object) -> tuple[InputFile, ...]:
    """The file and the layers that it uses, with their hashes."""
    paths = [str(layer.realPath) for layer in stage.GetUsedLayers() if layer.realPath]  # type: ignore[attr-defined]
    others = sorted({os.path.abspath(path) for path in paths} - {os.path.abspath(file)})
    found = []
    for role, path in [("robot", file), *(("included", path) for path in others if os.path.isfile(path))]:
        with open(path, "rb") as source:
            found.append(
                InputFile(
                    role,
                    path,
                    hashlib.file_digest(source, "sha256").hexdigest() if hasattr(hashlib, "file_digest") else hashlib.sha256(source.read()).hexdigest(),
                )
            )
        note(found[-1], DescriptionError)
    return tuple(found)
