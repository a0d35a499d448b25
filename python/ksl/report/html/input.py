"""What a report shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ksl.load_cases.provenance import Provenance
from ksl.load_cases.quantities import JointLoads, PowerBalance
from ksl.load_cases.undetermined import Undetermined
from ksl.load_cases.verdict import Verdict
from ksl.mechanism.states import Array
from ksl.report.html.rows import Row
from ksl.report.html.stills import Still

if TYPE_CHECKING:
    from ksl.load_cases.closed_mechanism import ClosedMechanism
    from ksl.sizing.joints.sizing import Sizing


@dataclass(frozen=True)
class CaseCurves:
    """The curves of one load case."""

    name: str
    time: Array
    """(n), s."""
    joints: Sequence[JointLoads]
    balance: PowerBalance | None
    """None if there are too few samples to differentiate the energy."""
    facts: Sequence[tuple[str, str]] = ()
    """What is special to this case: motion, payloads, gravity."""
    notes: Sequence[str] = ()
    """Notes about this case alone."""
    stills: Mapping[str, Still] = field(default_factory=dict)
    """By joint: the mechanism at the sample where this joint bears most."""
    undetermined: Undetermined = Undetermined()
    """What rigid bodies leave open."""
    raw_positions: Mapping[str, Array] = field(default_factory=dict)
    """By joint, where the motion was smoothed: the positions (n) as they were given, rad or m."""


@dataclass(frozen=True)
class ReportInput:
    """The contents of a report."""

    title: str
    facts: Sequence[tuple[str, str]]
    """What was computed, and how: a small table at the head."""
    notes: Sequence[str]
    """Most important first: limits exceeded, doubts, warnings, unused content of the files."""
    summary: Sequence[Row]
    """Rows of :func:`ksl.load_cases.quantities.summarise`, each with its `case` where there are several, of any of their joints."""
    cases: Sequence[CaseCurves]
    """The cases whose curves are shown, worst first; one at least.  Of many cases, the rest stands in `summary` alone."""
    provenance: Provenance | None = None
    """Inputs with their hashes, versions, date, command line: what a signature needs."""
    verdict: Verdict | None = None
    """Red, amber or green, with the shares of limits, and the reasons."""
    sizing: Sizing | None = None
    """Components against the loads."""
    closed: ClosedMechanism | None = None
    """The closed mechanism, where there are loops."""
    weight: float | None = None
    """The weight of the machine, N: what is round-off of its loads is judged by it."""
    payloads: Mapping[str, str] = field(default_factory=dict)
    """By load case, also of those that are not shown."""
