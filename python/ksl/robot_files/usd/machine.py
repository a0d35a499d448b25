"""What a USD file says, read by Pixar's library: in this process, or in one of its own, which ends when it is told to and is alone when memory runs out."""

from __future__ import annotations

import os
import pickle
import re
import tempfile
from dataclasses import dataclass, field
from typing import Any

from ksl.base import own_process
from ksl.base.errors import DescriptionError
from ksl.base.judged import OutOfBounds
from ksl.base.limits import USD_SECONDS
from ksl.base.printable import sentence
from ksl.robot_files.assembly import Body, Connection
from ksl.robot_files.usd.amounts import too_much

MOST_SAID = 20
"""Lines of USD's own that are passed on."""


@dataclass
class Machine:
    """What a stage says: plain data, which goes from one process to another."""

    name: str
    """The name of the default prim; empty without one."""
    gravity: list[float]
    bodies: list[Body]
    connections: list[Connection]
    driven: list[str]
    """Names of joints that have drives."""
    layers: list[str]
    """Paths of the files that it uses."""
    said: list[str] = field(default_factory=list)
    """Warnings."""
    unused: list[str] = field(default_factory=list)


def machine_of(file: str, independent: bool) -> Machine:
    """What a file says.  Raises ValueError, for a file that is refused without its name, and ModuleNotFoundError without usd-core."""
    if own_process.is_wanted():
        return _read_apart(file, independent)
    return _read_here(file, independent)


_READ = """
from ksl.robot_files.usd.machine import write_machine
try:
    write_machine(given["file"], given["independent"], given["to"])
    say()
except MemoryError:
    say(short=True)
except ModuleNotFoundError as e:
    say(lacks=e.name)
except ValueError as e:
    say(refused=str(e))
"""


def _read_apart(file: str, independent: bool) -> Machine:
    with tempfile.TemporaryDirectory() as folder:
        to = os.path.join(folder, "machine")
        try:
            made = own_process.run(_READ, {"file": file, "independent": independent, "to": to}, seconds=USD_SECONDS)
        except own_process.Ended as e:
            raise DescriptionError(f"USD didn't read the file to its end: {e}") from None
        if "lacks" in made:
            raise ModuleNotFoundError(name=made["lacks"])
        if "short" in made:
            raise MemoryError
        if "refused" in made:
            raise DescriptionError(made["refused"])
        with open(to, "rb") as source:
            machine = pickle.load(source)  # which this program wrote, in a folder of its own
    assert isinstance(machine, Machine)
    machine.said += [f"USD says: {_one_line(line, 300)}" for line in made["printed"].splitlines()[:MOST_SAID] if line.strip()]
    return machine


def write_machine(file: str, independent: bool, to: str) -> None:
    """What the process of its own does."""
    machine = _read_here(file, independent)
    with open(to, "wb") as target:
        pickle.dump(machine, target)


def _read_here(file: str, independent: bool) -> Machine:
    with _Trap() as trap:
        stage = _opened(file)
        _require_whole(stage)
        return _read(stage, independent, trap)


def _opened(file: str) -> Any:
    """The stage, if it asks for no more than is read."""
    from pxr import Sdf, Usd

    try:
        layer = Sdf.Layer.FindOrOpen(file)
    except Exception as e:  # errors of Tf, which are of several types
        raise _refused(e) from None
    if layer and (said := too_much(layer)):
        raise DescriptionError(said)
    try:
        return Usd.Stage.Open(file)  # which takes the same layer
    except Exception as e:
        raise _refused(e) from None


def _refused(error: Exception) -> DescriptionError:
    return DescriptionError(f"USD refuses the file: {_said(error, 500)}; correct it, or write it again")


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
        """The messages of USD so far, without repetitions."""
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


def _read(opened: object, independent: bool, trap: _Trap) -> Machine:
    """What a stage says.  Raises ValueError for values that USD lets a file have and that make no sense."""
    from ksl.robot_files.usd.couplings import couple
    from ksl.robot_files.usd.joints import joints_of, stack
    from ksl.robot_files.usd.masses import bodies_of
    from ksl.robot_files.usd.stage import gravity_of, require_values, units_of
    from ksl.robot_files.usd.unused import list_unused

    try:
        stage = units_of(opened)
        require_values(stage)
        bodies = bodies_of(stage)
        joints, driven = joints_of(stage, bodies)
        followers = couple(stage, bodies, joints, independent)
        stack(stage, bodies, joints)
        list_unused(stage)
        gravity = [float(x) for x in gravity_of(stage)]
        lines = trap.lines()
        stage.said += [f"USD says: {line}" for line in lines[:MOST_SAID]] + (
            [f"USD says {len(lines) - MOST_SAID} lines more"] if len(lines) > MOST_SAID else []
        )
        drives = [name for name in driven if name not in followers]
        layers = [str(layer.realPath) for layer in stage.stage.GetUsedLayers() if layer.realPath]
        return Machine(stage.name, gravity, list(bodies.values()), list(joints.values()), drives, layers, stage.said, stage.unused)
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
