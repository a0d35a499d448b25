"""What the report of a run shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ksl.load_cases.case_result import CaseResult
from ksl.load_cases.closed_mechanism import closed_mechanism
from ksl.load_cases.force_elements import element_ranges
from ksl.load_cases.load_case import LoadCase
from ksl.load_cases.provenance import Provenance
from ksl.load_cases.quantities import SummaryRow, weight_of
from ksl.load_cases.verdict import Verdict
from ksl.mechanism.mechanism import Mechanism
from ksl.report.html.input import CaseCurves, ReportInput
from ksl.report.html.stills import appearance_of, stills_of

if TYPE_CHECKING:
    from ksl.viewer.visuals import Appearance

Facts = list[tuple[str, str]]


def report_input(
    shown: Sequence[CaseResult], every: Sequence[LoadCase], rows: Sequence[SummaryRow], provenance: Provenance, verdict: Verdict, notes: Sequence[str]
) -> ReportInput:
    """shown: the load cases whose curves are shown, worst first.  Rows, verdict and notes are those of every load case."""
    first, several = shown[0].case, len(provenance.cases) > 1
    model = first.model
    facts = [("robot", f"{model.name} ({model.file})")]
    if several:
        facts.append(("load cases", _listed([case["name"] for case in provenance.cases])))
    facts += ([] if several else _scene(first)) + _expressed(first)
    look = appearance_of(first)  # meshes are read once
    cases = [_curves(result, several, look) for result in shown]
    closed = closed_mechanism(every) if model.loops else None
    payloads = {case.name: _payloads(case) for case in every}
    return ReportInput(
        f"Joint loads of {model.name}", facts, notes, rows, cases, provenance, verdict, closed=closed, weight=weight_of(model), payloads=payloads
    )


def _payloads(case: LoadCase) -> str:
    return "; ".join(str(payload) for payload in case.payloads) or "none"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:20]) + (f" and {len(names) - 20} more" if len(names) > 20 else "")


def _curves(result: CaseResult, several: bool, look: Appearance) -> CaseCurves:
    case, m, raw = result.case, result.case.model, result.case.motion.raw_q
    loads = [l for l in result.loads or [] if case.placement.wanted(l.joint.name)]
    facts = _scene(case) if several else []
    raw_positions = {} if raw is None else {l.joint.name: m.position_of(l.joint, raw) for l in loads if l.joint.one_coordinate and _given(case, l.joint.name)}
    doubts = result.doubts if several else ()
    return CaseCurves(case.name, case.motion.time, loads, result.balance, facts, doubts, stills_of(case, loads, look), case.undetermined, raw_positions)


def _given(case: LoadCase, joint: str) -> bool:
    """Whether the motion gives a joint's position; in a closed mechanism others follow, and were not smoothed."""
    closing = case.motion.closing
    return closing is None or joint in closing.held


def _scene(case: LoadCase) -> Facts:
    """What was computed, for people."""
    m, time = case.model, case.motion.time
    return [
        ("motion", case.motion_file or "arrays"),
        *([("what", case.kind)] if case.kind != "motion" else []),
        ("samples", f"{len(time)}, from {time[0]:.10g} s to {time[-1]:.10g} s"),
        ("gravity", f"({', '.join(f'{g:g}' for g in m.gravity)}) m/s² in world axes"),
        ("payloads", _payloads(case)),
        *([("physics of joints", _physics(m))] if m.physics else []),
        ("external wrenches", ", ".join(case.external) or "none"),
        *((f"force element {of.name}", of.text) for of in element_ranges(case)),
    ]


def _expressed(case: LoadCase) -> Facts:
    """How wrenches are expressed."""
    p = case.placement
    return [
        ("wrenches", f"on the {p.on} side of the joint, moments about {p.about}; here resolved along and across each joint's axis"),
        ("effort and power", "of each joint's drive, whatever point and side are chosen"),
        ("in the table", f"axes {p.axes}, order {p.order}"),
    ]


def _physics(model: Mechanism) -> str:
    """What is on, and the width of friction where its smooth law is."""
    width = f" (smooth, width {model.friction_width:g} rad/s or m/s unless the file gives another)" if "friction" in model.physics else ""
    return ", ".join(name + width if name == "friction" else name for name in model.physics) + ": the effort is the motor's"
