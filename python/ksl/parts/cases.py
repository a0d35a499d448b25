"""Load cases of parts: free bodies at chosen instants, and the files that are written of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import overload

from ksl.parts.free_body import FreeBody


@dataclass(frozen=True)
class FreeBodyCase:
    """The free bodies at one instant."""

    time: float
    """s."""
    case: str
    """The load case of the results."""
    bodies: Mapping[str, FreeBody]
    why: tuple[tuple[str, str], ...]
    """What is largest there: (joint, component), or what was asked for and "extreme"; empty at a given time."""

    @property
    def complete(self) -> bool:
        return all(body.complete for body in self.bodies.values())

    @property
    def reason(self) -> str:
        """What is largest there, in words: "elbow fx fy; wrist tz"."""
        by_joint: dict[str, list[str]] = {}
        for joint, component in self.why:
            by_joint.setdefault(joint, []).append(component)
        return "; ".join(f"{joint} {' '.join(components)}" for joint, components in by_joint.items()) or "given"


class Cases(Sequence[FreeBodyCase]):
    """Load cases of parts, in the order of load cases and times."""

    def __init__(self, cases: Sequence[FreeBodyCase], shares: Mapping[str, float], notes: Sequence[str], made_of: Mapping[str, str]) -> None:
        self._cases = tuple(cases)
        self.shares = dict(shares)
        """{what is stressed: the share of its largest stresses that the cases reach}; empty where no share was asked for."""
        self.notes = tuple(notes)
        self.made_of = dict(made_of)
        """Robot, results, load cases and versions."""

    @property
    def share(self) -> float | None:
        """The least of `shares`; None where none was asked for."""
        return min(self.shares.values(), default=None)

    @property
    def links(self) -> list[str]:
        return list(dict.fromkeys(top for case in self for top in case.bodies))

    @overload
    def __getitem__(self, index: int) -> FreeBodyCase: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[FreeBodyCase, ...]: ...
    def __getitem__(self, index: int | slice) -> FreeBodyCase | tuple[FreeBodyCase, ...]:
        return self._cases[index]

    def __iter__(self) -> Iterator[FreeBodyCase]:
        return iter(self._cases)

    def __len__(self) -> int:
        return len(self._cases)

    def __repr__(self) -> str:
        return f"<ksl free bodies of {self.made_of.get('robot', '')}: {len(self)} cases of {len(self.links)} bodies>"
