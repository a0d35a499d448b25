"""What a comparison found."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(frozen=True)
class Note:
    """A sentence about one convention or one rule."""

    topic: str
    """order, base, quaternion, frame, lumped links, armature …"""
    text: str
    explains: tuple[str, ...] = ()
    """The quantities whose difference it accounts for, in full or together with the other notes."""


@dataclass(frozen=True)
class Quantity:
    """One quantity of all states, in KSL's conventions, in both libraries."""

    name: str
    difference: float
    """The largest difference of two numbers, in `unit`."""
    relative: float
    """The largest difference as a share of the largest number of that quantity in KSL: of the same unit, where a quantity has several."""
    agrees: bool
    unit: str
    where: str
    """The joint or link, and the state, of the largest difference; empty where all numbers are the same."""


@dataclass
class OneLibrary:
    """The robot in one other library."""

    name: str
    version: str = ""
    failed: str = ""
    """Why nothing could be compared; empty otherwise."""
    quantities: list[Quantity] = field(default_factory=list)
    conventions: list[Note] = field(default_factory=list)
    """What had to be converted, and what is left out on one side, before numbers could be compared."""
    reasons: list[Note] = field(default_factory=list)
    """Why numbers differ: what, applied to KSL's model, gives the other library's numbers."""
    not_compared: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    """Warnings of the library about the file."""

    @property
    def differing(self) -> list[str]:
        """Names of quantities that differ."""
        return [q.name for q in self.quantities if not q.agrees]

    @property
    def unexplained(self) -> list[str]:
        """Names of quantities whose difference no reason accounts for."""
        explained = {name for reason in self.reasons for name in reason.explains}
        return [name for name in self.differing if name not in explained]

    @property
    def status(self) -> int:
        """0: all numbers agree; 1: some differ, and it is known why; 2: it is not known why, or nothing could be compared."""
        if self.failed or self.unexplained:
            return 2
        return 1 if self.differing else 0


@dataclass(frozen=True)
class Comparison:
    """A robot in KSL and in other libraries, from :func:`ksl.compare`."""

    file: str
    robot: str
    coordinates: int
    states: int
    seed: int
    libraries: tuple[OneLibrary, ...]
    missing: dict[str, str]
    """Libraries that are not installed, and the command that brings each."""

    def __getitem__(self, name: str) -> OneLibrary:
        """The results of one library.  Raises KeyError for one that was not compared with."""
        for library in self.libraries:
            if library.name == name:
                return library
        known = ", ".join(library.name for library in self.libraries) or "none"
        raise KeyError(f"no results of {name!r}; there are those of {known}")

    @property
    def status(self) -> int:
        """The worst of the libraries, as :attr:`OneLibrary.status` has it; 2 where no library was there to compare with."""
        return max((library.status for library in self.libraries), default=2)

    def as_dict(self) -> dict[str, Any]:
        """All of it as plain values, for JSON."""
        return asdict(self) | {
            "libraries": [asdict(x) | {"differing": x.differing, "unexplained": x.unexplained, "status": x.status} for x in self.libraries],
            "status": self.status,
        }
