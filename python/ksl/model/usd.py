"""USD files, read through the package `usd-core`: rigid bodies and joints of UsdPhysics."""

from __future__ import annotations

import hashlib
import os
from typing import TYPE_CHECKING

from ksl.base.errors import DescriptionError
from ksl.base.files_read import InputFile, note
from ksl.base.printable import sentence
from ksl.base.words import listed
from ksl.model import given
from ksl.model.assembly import Body, Connection, assembled, gap, in_double
from ksl.model.builder import Builder
from ksl.model.model import Model

if TYPE_CHECKING:
    from ksl.model.usd_stage import Stage

APART, TURNED = 1e-4, 1e-3
"""m, and the sine of an angle: bodies that stand further from what their joint allows are said.  Single precision leaves some 1e-6."""


def load_usd(file: str, how: given.Reading) -> Model:
    """The robot of a stage.  Raises DescriptionError."""
    try:
        from pxr import Usd
    except ModuleNotFoundError as e:
        if e.name != "pxr":
            raise
        raise DescriptionError(f"{file}: this is USD, which is read by the package usd-core; install it with: pip install 'ksl[usd]'") from None
    try:
        stage = Usd.Stage.Open(file)
    except Exception as e:  # errors of Tf, which are of several types
        raise DescriptionError(f"{file}: USD refuses the file: {_said(e, 500)}; correct it, or write it again") from None
    try:
        return _model(file, stage, how)
    except ValueError as e:
        raise DescriptionError(str(e) if str(e).startswith(f"{file}:") else f"{file}: {e}") from None


def _model(file: str, opened: object, how: given.Reading) -> Model:
    stage, down, bodies, connections, driven = _read(opened)
    if not bodies:
        raise DescriptionError("no rigid body (PhysicsRigidBodyAPI) is in the file: it has shapes alone, or its physics are in another layer; give that file")
    in_double(list(bodies.values()), connections)
    builder = Builder(stage.name or os.path.splitext(os.path.basename(file))[0] or "robot", gravity=down)
    made = assembled(builder, list(bodies.values()), connections, how.cut)
    if how.floating_base and not made.floating:
        raise DescriptionError("a floating base is asked for, but joints connect all bodies to the world; remove that joint, or don't ask for it")
    if made.loops and not how.cut:
        _say_loops(made.loops, connections, stage.said)
        drives = [name for name in driven if name not in made.loops]
        if drives:
            builder._core.set_drives(drives, [])
    _say_gaps(connections, list(bodies.values()), stage.said)
    if made.turned:
        stage.said.append(f"joint {listed(made.turned)}: body1 carries body0; the axis points the other way, so that the position is that of the file (the opposite, of spherical and translation joints)")
    builder._core.read_from(file, stage.unused, stage.said)
    core = builder._core.build(False, how.strict, how.gravity, how.points, how.massless)
    return Model(core, inputs=_inputs(file, stage.stage))


def _read(opened: object) -> tuple[Stage, list[float], dict[str, Body], list[Connection], list[str]]:
    """The stage, gravity, bodies, joints, and the names of those with drives.  Raises ValueError for values that USD lets a file have and that make no sense."""
    from ksl.model.usd_joints import joints_of
    from ksl.model.usd_stage import bodies_of, gravity_of, units_of

    try:
        stage = units_of(opened)
        bodies = bodies_of(stage)
        connections, driven = joints_of(stage, bodies)
        return stage, [float(x) for x in gravity_of(stage)], bodies, connections, driven
    except (DescriptionError, MemoryError):
        raise
    except Exception as e:  # values of types that an attribute can't have, and what USD finds late
        said = f"USD can't make sense of the file ({type(e).__name__}: {_said(e, 300)}); correct it, or write it again"
        raise DescriptionError(said) from None


def _said(error: Exception, most: int) -> str:
    """What USD says, on one line."""
    try:
        return sentence(" ".join(str(error).split()))[:most]
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
            said.append(f"joint {c.name}: its bodies stand where it doesn't let them: its frames are {apart:.3g} m and {turned:.3g} rad apart; those of the joint count, not the poses of the bodies")


def _inputs(file: str, stage: object) -> tuple[InputFile, ...]:
    """The file and the layers that it uses, with their hashes."""
    paths = [str(layer.realPath) for layer in stage.GetUsedLayers() if layer.realPath]  # type: ignore[attr-defined]
    others = sorted({os.path.abspath(path) for path in paths} - {os.path.abspath(file)})
    found = []
    for role, path in [("robot", file), *(("included", path) for path in others if os.path.isfile(path))]:
        with open(path, "rb") as source:
            found.append(InputFile(role, path, hashlib.file_digest(source, "sha256").hexdigest() if hasattr(hashlib, "file_digest") else hashlib.sha256(source.read()).hexdigest()))
        note(found[-1], DescriptionError)
    return tuple(found)
