"""USD files, read through the package `usd-core`: rigid bodies and joints of UsdPhysics."""

from __future__ import annotations

import hashlib
import os

from ksl.base.errors import DescriptionError
from ksl.base.files_read import InputFile, note
from ksl.base.words import listed
from ksl.robot_files.assembly import Connection, assembled, in_double
from ksl.model.builder import Builder, core_of_builder
from ksl.mechanism.core_sentences import with_file
from ksl.model.model import Model
from ksl.robot_files.read_options import ReadOptions
from ksl.robot_files.usd.couplings import require_in_tree
from ksl.robot_files.usd.machine import Machine, machine_of

APART, TURNED = 1e-4, 1e-3
"""m, and the sine of an angle: bodies that stand further from what their joint allows are said.  Single precision leaves some 1e-6."""


def load_usd(file: str, options: ReadOptions) -> Model:
    """The robot of a stage.  Raises DescriptionError."""
    try:
        return _model(file, machine_of(file, options.mimic_independent), options)
    except ModuleNotFoundError as e:
        if e.name != "pxr":
            raise
        raise DescriptionError(f"{file}: this is USD, which is read by the package usd-core; install it with: pip install 'ksl[usd]'") from None
    except ValueError as e:
        raise DescriptionError(with_file(file, e)) from None


def _model(file: str, machine: Machine, options: ReadOptions) -> Model:
    bodies, connections, said = machine.bodies, machine.connections, machine.said
    if not bodies:
        raise DescriptionError("no rigid body (PhysicsRigidBodyAPI) is in the file: it has shapes alone, or its physics are in another layer; give that file")
    gaps = in_double(bodies, connections)
    builder = Builder(machine.name or os.path.splitext(os.path.basename(file))[0] or "robot", gravity=machine.gravity)
    made = assembled(builder, bodies, connections, options.cut_loops)
    if not options.cut_loops:
        require_in_tree(connections, made.loops)
    if options.floating_base and not made.floating:
        raise DescriptionError("a floating base is asked for, but joints connect all bodies to the world; remove that joint, or don't ask for it")
    if made.loops and not options.cut_loops:
        _say_loops(made.loops, connections, said)
        drives = [name for name in machine.driven if name not in made.loops]
        if drives:
            core_of_builder(builder).set_drives(drives, [])
    _say_gaps(connections, gaps, said)
    if made.turned:
        said.append(
            f"joint {listed(made.turned)}: body1 carries body0; the axis points the other way, so that the position is that of the file (the opposite, of spherical and translation joints)"
        )
    core_of_builder(builder).read_from(file, machine.unused, said)
    core = core_of_builder(builder).build(False, *options.of_builder())
    return Model(core, inputs=_inputs(file, machine.layers), payloads=options.carried)


def _say_loops(loops: list[str], connections: list[Connection], said: list[str]) -> None:
    """Joints that close loops though the file doesn't exclude them from the articulation."""
    other = [c.name for c in connections if c.name in loops and not c.closes]
    if other:
        said.append(f"joint {listed(other)}: closes a loop, and excludeFromArticulation doesn't say so; the tree is made of the joints before it")


def _say_gaps(connections: list[Connection], gaps: list[tuple[float, float]], said: list[str]) -> None:
    for c, (apart, turned) in zip(connections, gaps, strict=True):
        if apart > APART or turned > TURNED:
            said.append(
                f"joint {c.name}: its bodies stand where it doesn't let them: its frames are {apart:.3g} m and {turned:.3g} rad apart; those of the joint count, not the poses of the bodies"
            )


def _inputs(file: str, layers: list[str]) -> tuple[InputFile, ...]:
    """The file and the layers that it uses, with their hashes."""
    others = sorted({os.path.abspath(path) for path in layers} - {os.path.abspath(file)})
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
