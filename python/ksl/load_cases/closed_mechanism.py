"""What there is to say of a closed mechanism: loops, freedoms, redundant equations, drives, and how well a motion is closed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from ksl.mechanism.calls import Calls
from ksl.mechanism.loops import Mobility
from ksl.mechanism.mechanism import Mechanism
from ksl.mechanism.stiffness import compliances_of, rigid_beside
from ksl.motions.closing import NotClosed, home

if TYPE_CHECKING:
    from ksl.load_cases.load_case import LoadCase


@dataclass(frozen=True)
class ClosedMechanism:
    """What is said of the loops of one position, and of the motions of load cases."""

    loops: tuple[str, ...]
    """`C, revolute, coupler → rocker` for each."""
    drives: tuple[str, ...]
    mobility: int
    """Freedoms at the first position."""
    redundant: tuple[str, ...]
    """Loop joint and number of the equations that follow from others: `C: 3 of 5`."""
    held: tuple[str, ...] = ()
    """The joints whose positions the motion gives."""
    error: float = 0.0
    """The largest error of closed loops along the motions, m."""
    error_time: float = 0.0
    error_case: str = ""
    undetermined: Mapping[str, tuple[str, ...]] | None = None
    """{joint: components}, over all load cases."""
    open_in: tuple[str, ...] = ()
    """The load cases in which components are open."""
    stiff: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """{load case: the joints that give way}, of cases with stiffnesses."""
    rigid: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """{load case: the joints of the loops that don't}, of the same cases."""
    cases: tuple[str, ...] = ()
    """All load cases."""

    def lines(self) -> list[tuple[str, str]]:
        """For people."""
        closed = f"largest error {self.error:.2g} m, at {self.error_time:.6g} s" + (f" of {self.error_case}" if self.error_case else "")
        return [
            ("loops", "; ".join(self.loops)),
            ("freedoms", f"{self.mobility}, driven by {', '.join(self.drives) or 'nothing'}"),
            *([("positions", f"given for {', '.join(self.held)}; all others follow")] if self.held else []),
            ("redundant equations", ", ".join(self.redundant) or "none"),
            ("stiffnesses", self._stiffnesses()),
            *([("closure", closed)] if self.held else []),
        ]

    def _stiffnesses(self) -> str:
        """Which joints give way, in which load cases."""
        if not self.stiff:
            return "none: all joints are rigid"
        alike: dict[str, list[str]] = {}
        for case, names in self.stiff.items():
            rigid = f"; without one, and therefore rigid: {', '.join(self.rigid[case])}" if self.rigid[case] else ""
            alike.setdefault(f"of {', '.join(names)}{rigid}", []).append(case)
        without = [case for case in self.cases if case not in self.stiff]
        alike |= {"none: all joints are rigid": without} if without else {}
        return "; ".join(text if len(alike) == 1 else f"{', '.join(cases)}: {text}" for text, cases in alike.items())

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def loop_lines(model: Mechanism) -> tuple[str, ...]:
    """A line for each loop joint: name, kind and links."""
    return tuple(f"{loop.name}, {loop.kind}, {loop.predecessor} → {loop.successor}" for loop in model.loops)


def redundant_lines(model: Mechanism, found: Mobility) -> tuple[str, ...]:
    """`C: 3 of 5` for each loop joint some of whose equations follow from the others."""
    names = [name for name, _ in found.redundant_rows]
    return tuple(f"{loop.name}: {names.count(loop.name)} of {loop.equations}" for loop in model.loops if loop.name in names)


def mobility_at_home(model: Calls) -> tuple[Mobility | None, str]:
    """The freedoms at the closed position nearest to the neutral one; None, and why, where there is none."""
    try:
        return model.mobility(home(model, model.drives or ())), ""
    except NotClosed as e:
        return None, e.why


def closed_mechanism(cases: Sequence[LoadCase]) -> ClosedMechanism:
    """The closed mechanism of load cases with the same robot, which has loops."""
    model = cases[0].model
    found = model.mobility(cases[0].motion.q[0])
    closings = [(case, case.motion.closing) for case in cases if case.motion.closing is not None]
    worst, closing = max(closings, key=lambda x: x[1].error, default=(None, None))
    open_components: dict[str, tuple[str, ...]] = {}
    for case in cases:
        for joint, names in case.undetermined.components.items():
            open_components[joint] = tuple(dict.fromkeys((*open_components.get(joint, ()), *names)))
    stiff = {case.name: tuple(compliances_of(case.model)) for case in cases}
    stiff = {name: joints for name, joints in stiff.items() if joints}
    rigid = {case.name: tuple(rigid_beside(case.model)) for case in cases if case.name in stiff}
    open_in = tuple(case.name for case in cases if case.undetermined.components)
    of_case = worst.name if worst is not None and len(cases) > 1 else ""
    return ClosedMechanism(
        loop_lines(model), model.drives or (), found.mobility, redundant_lines(model, found), closing.held if closing else (),
        closing.error if closing else 0.0, closing.error_time if closing else 0.0, of_case, open_components,
        open_in, stiff, rigid, tuple(case.name for case in cases),
    )  # fmt: skip
