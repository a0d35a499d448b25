"""What a report shows."""

from __future__ import annotations

from dataclasses import dataclass

from ksl.load_cases.provenance import Provenance
from ksl.load_cases.quantities import JointLoads, PowerBalance
from ksl.states import Array


@dataclass(frozen=True)
class ReportInput:
    """The contents of a report."""

    title: str
    facts: list[tuple[str, str]]
    """What was computed, and how: a small table at the head."""
    notes: list[str]
    """Warnings, unused content of the files, limits exceeded: a line each, foldable."""
    summary: list[dict[str, float | str | None]]
    """Rows of :func:`ksl.load_cases.quantities.summarise`, of any of `joints`."""
    time: Array
    """(n), s."""
    joints: list[JointLoads]
    balance: PowerBalance | None
    """None if there are too few samples to differentiate the energy."""
    provenance: Provenance | None = None
    """Inputs with their hashes, versions, date, command line: what a signature needs."""
