"""What was chosen from a catalogue, and why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from ksl.sizing.choice.together import Together
from ksl.sizing.parts import Part


@dataclass(frozen=True)
class Chosen:
    """The entry that was chosen for a joint."""

    joint: str
    kind: str
    name: str
    mass: float
    """kg."""
    price: float | None
    size: str
    utilisation: float
    """Of its worst figure."""
    figure: str
    is_held: bool
    """Whether it holds with the margin: false may be one whose choices go round in circles."""
    margin: float
    by: str
    """mass or price."""
    rejected: Mapping[str, tuple[str, float]]
    """{entry that has less of it: (its worst figure, utilisation)}, the least first."""
    holds: tuple[str, ...]
    """All entries that hold, in the same order."""
    front: tuple[str, ...]
    """Those of them of which none is both lighter and less used."""
    link: str | None
    at: tuple[float, float, float]

    @property
    def why(self) -> str:
        """Why the next smaller one doesn't do."""
        if not self.rejected:
            return "the least of the catalogue"
        name, (figure, used) = list(self.rejected.items())[-1]
        return f"{name}: {figure} {used:.3g}" if figure else f"{name}: nothing to compare"


@dataclass(frozen=True)
class Selection:
    """The choice for all requests, joint by joint."""

    choices: tuple[Chosen, ...]
    rounds: int
    """How often all joints were chosen for, the last time without a change."""
    settled: bool
    """False where choices go round in circles: each joint then has the heaviest of its circle."""
    parts: tuple[Part, ...]
    masses: tuple[float, ...]
    """kg at the link of each request; 0 for those without one."""
    together: Together | None
    doubts: tuple[str, ...] = ()
    """Lengths that are likely in millimetres."""

    @property
    def payloads(self) -> dict[str, list[tuple[float, tuple[float, float, float]]]]:
        """{link: [(mass in kg, point in its frame in m)]} of what was chosen, as `Model.with_payload` takes them one by one."""
        found: dict[str, list[tuple[float, tuple[float, float, float]]]] = {}
        for c in self.choices:
            if c.link is not None:
                found.setdefault(c.link, []).append((c.mass, c.at))
        return found

    @property
    def notes(self) -> tuple[str, ...]:
        """What the reader should know of the choice."""
        found = []
        if not self.settled:
            found.append("the choice does not settle: the masses of what is chosen change what is chosen, round in circles; each joint has the heaviest of its circle")
        over = [f"{c.name} of {c.joint}" for c in self.choices if not c.is_held]
        if over:
            found.append(f"with the loads of this choice these don't hold: {', '.join(over)}")
        return (*self.doubts, *found, *([self.together.sentence] if self.together else []))

    def as_dict(self) -> dict[str, Any]:
        """Everything in numbers and words, as JSON can hold it."""
        return {
            "choices": [asdict(c) | {"why": c.why} for c in self.choices],
            "rounds": self.rounds,
            "settled": self.settled,
            "together": None if self.together is None else asdict(self.together) | {"sentence": self.together.sentence},
        }
