"""report.json: everything that the report says in numbers."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

from ksl._core import __version__
from ksl.load_cases.quantities import PowerBalance
from ksl.load_cases.verdict import worst_level
from ksl.report.html.input import CaseCurves, ReportInput
from ksl.report.html.rows import joint_units, with_limits

SCHEMA = 1
"""Number of the form of the file.  It grows when a key changes its meaning or goes; keys may be added at any time."""


def report_numbers(report: ReportInput) -> dict[str, Any]:
    """What the report says, as values that JSON can hold.  docs/loads.md describes the keys."""
    joints = {loads.joint.name: loads.joint for case in report.cases for loads in case.joints}
    return {
        "schema": SCHEMA,
        "version": __version__,
        "title": report.title,
        "facts": dict(report.facts),
        "notes": list(report.notes),
        "level": worst_level(judged.level for judged in (report.verdict, report.sizing) if judged is not None),
        "verdict": None if report.verdict is None else report.verdict.as_dict(),
        "sizing": None if report.sizing is None else report.sizing.as_dict(),
        **({} if report.closed is None else {"closed_mechanism": report.closed.as_dict()}),
        "provenance": None if report.provenance is None else report.provenance.metadata(),
        "units": {name: joint_units(joint) for name, joint in joints.items()},
        "summary": [with_limits(row, joints[str(row["joint"])]) for row in report.summary],
        "cases": [_case(case) for case in report.cases],
    }


def write_json(path: str | os.PathLike[str], report: ReportInput) -> None:
    """Writes :func:`report_numbers`.  Numbers that are not finite are null, since JSON has no others."""
    text = json.dumps(_finite(report_numbers(report)), indent=1, ensure_ascii=False, allow_nan=False)
    Path(path).write_bytes((text + "\n").encode("utf-8", errors="replace"))


def _case(case: CaseCurves) -> dict[str, Any]:
    whole = {"name": case.name, "facts": dict(case.facts), "notes": list(case.notes), "samples": len(case.time)}
    return {**whole, "start": float(case.time[0]), "end": float(case.time[-1]), "power_balance": _balance(case.balance)}


def _balance(b: PowerBalance | None) -> dict[str, Any] | None:
    if b is None:
        return None
    return {"largest_residual": float(abs(b.residual).max()), "relative_residual": b.relative_residual, "largest_power": b.largest_power, "at_rest": b.at_rest}


def _finite(x: Any) -> Any:
    if isinstance(x, dict):
        return {key: _finite(value) for key, value in x.items()}
    if isinstance(x, (list, tuple)):
        return [_finite(value) for value in x]
    return None if isinstance(x, float) and not math.isfinite(x) else x
