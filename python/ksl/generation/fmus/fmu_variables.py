"""Variables of an FMU: their names, units and start values, in the order of their value references."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from ksl import _core
from ksl.base.printable import one_line

if TYPE_CHECKING:
    from ksl.model.model import Model

Kind = Literal["forward", "inverse"]
Causality = Literal["parameter", "input", "output"]
COMPONENTS = ("fx", "fy", "fz", "tx", "ty", "tz")
UNITS: dict[str, dict[str, int]] = {
    "s": {"s": 1}, "m": {"m": 1}, "rad": {"rad": 1}, "m/s": {"m": 1, "s": -1}, "rad/s": {"rad": 1, "s": -1}, "m/s2": {"m": 1, "s": -2}, "rad/s2": {"rad": 1, "s": -2},
    "N": {"kg": 1, "m": 1, "s": -2}, "N.m": {"kg": 1, "m": 2, "s": -2},
}  # fmt: skip
"""By powers of base units.  What has none, a number of a quaternion, has no unit in the file."""
TAKEN = ("time", "step")
"""Names of variables that no joint has."""


@dataclass(frozen=True)
class Variable:
    name: str
    causality: Causality
    unit: str
    start: float
    """The number at the start of parameters and inputs; that of outputs follows."""
    text: str
    depends_on_inputs: bool = True
    """Does an output follow an input at the same instant?"""


@dataclass(frozen=True)
class Layout:
    """The numbers of an FMU in order: parameters, inputs, outputs.  Value reference k + 1 is the k-th; 0 is time."""

    variables: tuple[Variable, ...]
    places: dict[str, int]
    """{group: its first number}: step, q_start, v_start, q, v, a, tau, reactions, as far as there are such."""
    quaternions: tuple[int, ...]
    """Places of quaternions that are set from outside: x, y, z, w."""

    def first(self, causality: Causality) -> int:
        """The number of variables before the first of them, or of a later kind."""
        order = ("parameter", "input", "output")
        return sum(order.index(v.causality) < order.index(causality) for v in self.variables)


class _Names:
    """Names that nobody else has: a joint `time`, or one that ends as variables of another do, gets a `_` behind it.  Invisible characters are written as their numbers."""

    def __init__(self) -> None:
        self._taken = set(TAKEN)

    def new(self, name: str) -> str:
        name = one_line(name)
        while name in self._taken:
            name += "_"
        self._taken.add(name)
        return name


def layout_of(model: Model, kind: Kind, reaction_joints: Sequence[str], step: float) -> Layout:
    """Variables of a mechanism in motion ("forward"), or of one whose motion is given ("inverse")."""
    names, variables, places, quaternions = _Names(), list[Variable](), dict[str, int](), list[int]()

    def add(group: str, causality: Causality, numbers: Iterator[tuple[str, str, str]], starts: Sequence[float] = (), free: bool = False) -> None:
        places[group] = len(variables)
        for k, (name, unit, text) in enumerate(numbers):
            variables.append(Variable(names.new(name), causality, unit, starts[k] if starts else 0.0, one_line(text), not free))

    neutral = [float(x) for x in (model.close(model.neutral()).q if model.loops else model.neutral())]
    if kind == "forward":
        variables.append(Variable("step", "parameter", "s", step, "longest step of the method"))
        places["step"] = 0
        add("q_start", "parameter", _numbers(model, "q", ".start", "initial "), neutral)
        add("v_start", "parameter", _numbers(model, "v", ".start", "initial "))
        add("tau", "input", _numbers(model, "tau"))
    for group, starts in (("q", neutral), ("v", []), ("a", [])):
        add(group, "output" if kind == "forward" else "input", _numbers(model, group), starts, free=group != "a")
    if kind == "inverse":
        add("tau", "output", _numbers(model, "tau"))
    if reaction_joints:
        add("reactions", "output", _reactions(reaction_joints))
    set_from_outside = places["q_start" if kind == "forward" else "q"]
    quaternions.extend(set_from_outside + joint.q_index + place for joint in moving_joints(model) if (place := _KINDS[joint.kind].quaternion) is not None)
    return Layout(tuple(variables), places, tuple(quaternions))


_KINDS = {kind.name: kind for kind in _core.joint_kinds}
_ROLES = {"q": ("position", "position", ""), "v": ("velocity", "velocity", "/s"), "a": ("acceleration", "acceleration", "/s2"), "tau": ("effort", "effort", "")}
"""{group: (what a kind of joint calls its numbers, what it is, the end of its unit)}."""


def moving_joints(model: Model) -> list[Any]:
    """In the order of q."""
    return sorted((joint for joint in map(model.joint, model.joint_names) if joint.nv), key=lambda joint: joint.v_index)


def _numbers(model: Model, group: str, ending: str = "", before: str = "") -> Iterator[tuple[str, str, str]]:
    """Name, unit and text of each number of q, v, a or tau: names of columns of motions; those of efforts have `.effort` in them."""
    role, what, per = _ROLES[group]
    for joint in moving_joints(model):
        kind = _KINDS[joint.kind]
        for word, unit in zip(getattr(kind, role), kind.position_unit if group == "q" else kind.velocity_unit):
            unit = {"rad": "N.m", "m": "N"}[unit] if group == "tau" else f"{unit}{per}" if unit else ""
            parts = [joint.name, "effort" if group == "tau" else "", word]
            yield ".".join(part for part in parts if part) + ending, unit, f"{before}{what} of the joint {joint.name}"


def _reactions(joints: Sequence[str]) -> Iterator[tuple[str, str, str]]:
    for joint in joints:
        for component in COMPONENTS:
            what = "force" if component[0] == "f" else "moment about the joint's origin"
            yield (
                f"{joint}.reaction.{component}",
                "N" if component[0] == "f" else "N.m",
                f"{what} along {component[1]} that the joint {joint} exerts on its child, in the child's axes",
            )
