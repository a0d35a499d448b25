"""What was chosen from a catalogue, and why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from ksl.model.model import Model
from ksl.sizing.choice.together import Together
from ksl.sizing.catalogue.parts import Part


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
    """The utilisation of the entry's worst figure."""
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
    """The entries that hold of which no other is both lighter and less used."""
    link: str | None
    at: tuple[float, float, float]
    unjudged: tuple[str, ...] = ()
    """Figures by which others of the catalogue are compared and this entry isn't, since it lacks numbers."""

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
    said: tuple[str, ...] = ()
    """Notes on the places and the results: lengths that are likely in millimetres, sweeps."""

    def on(self, robot: Model) -> Model:
        """The robot with what was chosen as point masses on its links.  Rotors act on their own drives alone, by the formula of sizing.

        heavier = sizing.selection.on(robot)
        """
        for c in self.choices:
            robot = robot.with_payload(c.link, c.mass, c.at) if c.link is not None else robot
        return robot

    @property
    def notes(self) -> tuple[str, ...]:
        """What the reader should know of the choice."""
        found = []
        if not self.settled:
            found.append(
                "the choice does not settle: the masses of what is chosen change what is chosen, round in circles; each joint has the heaviest of its circle"
            )
        over = [f"{c.name} of {c.joint}" for c in self.choices if not c.is_held]
        if over:
            found.append(f"with the loads of this choice these don't hold: {', '.join(over)}")
        found += [
            f"{c.name} of {c.joint} isn't compared by {', '.join(c.unjudged)}, as others are: the catalogue lacks its numbers"
            for c in self.choices
            if c.unjudged
        ]
        return (*self.said, *found, *([self.together.sentence] if self.together else []))

    def as_rows(self) -> list[dict[str, str | float | None]]:
        """A row for each choice, with words and numbers alone."""
        names = ("joint", "kind", "name", "size", "mass", "price", "utilisation", "figure", "margin", "by", "link")
        words = ({"next_smaller_fails": c.why, "holds": ", ".join(c.holds), "front": ", ".join(c.front)} for c in self.choices)
        return [{name: getattr(c, name) for name in names} | of for c, of in zip(self.choices, words, strict=True)]

    def as_dict(self) -> dict[str, Any]:
        """Everything in numbers and words, as JSON can hold it."""
        return {
            "choices": [asdict(c) | {"why": c.why} for c in self.choices],
            "rounds": self.rounds,
            "settled": self.settled,
            "together": None if self.together is None else asdict(self.together) | {"sentence": self.together.sentence},
        }
