"""What the report of a load case shows."""

from __future__ import annotations

from collections.abc import Sequence

from ksl.load_cases.case_result import CaseResult
from ksl.load_cases.load_case import LoadCase
from ksl.load_cases.provenance import Provenance
from ksl.load_cases.verdict import Verdict
from ksl.mechanism import Mechanism
from ksl.report.page import ReportInput


def report_input(result: CaseResult, provenance: Provenance, verdict: Verdict, notes: Sequence[str], others: Sequence[str]) -> ReportInput:
    """The report of a load case.  Verdict and notes are those of all load cases; others: the names of those with reports beside it."""
    case, model = result.case, result.case.model
    wanted = case.placement.wanted
    loads = [l for l in result.loads or [] if wanted(l.joint.name)]
    rows = [row for row in result.rows if wanted(str(row["joint"]))]
    title = f"Joint loads of {model.name}"
    facts = [("robot", f"{model.name} ({model.file})")]
    if len(provenance.cases) > 1:
        title += f", load case {case.name}"
        listed = f"; others: {', '.join(others)}" if others else ""
        facts.append(("load case", f"{case.name}, one of {len(provenance.cases)}{listed}"))
    facts += _scene(case)
    return ReportInput(title, facts, list(notes), rows, case.motion.time, loads, result.balance, provenance=provenance, verdict=verdict)


def _scene(case: LoadCase) -> list[tuple[str, str]]:
    """What was computed, for people: the load case, and how its wrenches are expressed."""
    p, m, time = case.placement, case.model, case.motion.time
    return [
        ("motion", case.motion_file or "arrays"),
        *([("what", case.kind)] if case.kind != "motion" else []),
        ("samples", f"{len(time)}, from {time[0]:.10g} s to {time[-1]:.10g} s"),
        ("gravity", f"({', '.join(f'{g:g}' for g in m.gravity)}) m/s² in world axes"),
        ("payloads", "; ".join(str(payload) for payload in case.payloads) or "none"),
        ("wrenches", f"on the {p.on} side of the joint, moments about {p.about}; here resolved along and across each joint's axis"),
        ("effort and power", f"of each joint's drive, {'which brakes relieve' if case.brake else 'whatever point and side are chosen'}"),
        *([("physics of joints", _physics(m))] if m.physics else []),
        ("in the table", f"axes {p.axes}, order {p.order}"),
        ("external wrenches", ", ".join(case.external) or "none"),
    ]


def _physics(model: Mechanism) -> str:
    """What is on, and the width of friction where its smooth law is."""
    width = f" (smooth, width {model.friction_width:g} rad/s or m/s unless the file gives another)" if "friction" in model.physics else ""
    return ", ".join(name + width if name == "friction" else name for name in model.physics) + ": the effort is the motor's"
