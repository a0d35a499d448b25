"""The summary: a row for each load case and joint, and the worst over all cases."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ksl.base.csv_cells import csv_comment, csv_row, csv_text
from ksl.base.extras import require
from ksl.load_cases.provenance import UNITS, Provenance
from ksl.load_cases.quantities import UNDETERMINED, SummaryRow

if TYPE_CHECKING:
    import pyarrow as pa

SUMMARY = "summary.csv"
FIRST_LINE = "# KSL: summary of the joint loads of"
"""How this file begins; the robot's name follows."""
ALL_CASES = "all cases"
"""The `case` of rows that are the worst over all load cases."""
PEAKS = "largest magnitudes, and the time of the first sample that has it; at_peak is the value there with its sign, positive along the joint's axis; rms and mean are weighted by time"
_SIGN = {"position_lowest": -1, "work_negative": -1, "position_highest": 1}
"""The quantities whose worst value is the smallest (−1) or the largest (1); of all others the largest magnitude is."""


def worst_rows(rows: Sequence[SummaryRow]) -> list[SummaryRow]:
    """A row for each joint with the worst of each quantity over all load cases.

    QUANTITY_case names the case, and QUANTITY_time is its time.
    """
    by_joint: dict[str, list[SummaryRow]] = {}
    for row in rows:
        by_joint.setdefault(str(row["joint"]), []).append(row)
    return [_worst(joint, together) for joint, together in by_joint.items()]


def _worst(joint: str, rows: list[SummaryRow]) -> SummaryRow:
    worst: SummaryRow = {"case": ALL_CASES, "joint": joint, "kind": rows[0]["kind"]}
    names = dict.fromkeys(name for row in rows for name in row if name not in (*worst, UNDETERMINED) and not name.endswith(("_time", "_at_peak")))
    for name in names:
        having = [row for row in rows if name in row]
        sign = _SIGN.get(name)
        sizes = [abs(float(row[name] or 0.0)) if sign is None else sign * float(row[name] or 0.0) for row in having]
        governing = having[sizes.index(max(sizes))]
        worst[name] = governing[name]
        if f"{name}_time" in governing:
            worst[f"{name}_time"] = governing[f"{name}_time"]
        if (value := f"{name.removesuffix('_peak')}_at_peak") in governing and name.endswith("_peak"):
            worst[value] = governing[value]
        worst[f"{name}_case"] = governing["case"]
    if UNDETERMINED in rows[0]:
        worst[UNDETERMINED] = " ".join(sorted({word for row in rows for word in str(row[UNDETERMINED]).split()}))
    return worst


def all_rows(rows: Sequence[SummaryRow]) -> list[SummaryRow]:
    """The rows, and below them, if there are several load cases, the worst over all."""
    several = len({row["case"] for row in rows}) > 1
    return [*rows, *(worst_rows(rows) if several else [])]


def columns_of_rows(rows: Sequence[SummaryRow]) -> list[str]:
    """Names of all columns; those that name cases are last."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    return sorted(names, key=lambda name: name.endswith("_case"))


def write_summary(path: Path, rows: Sequence[SummaryRow], provenance: Provenance) -> None:
    """summary.csv: rows below lines that begin with `# ` and say units and what made the numbers."""
    rows = all_rows(rows)
    head = [*provenance.lines(), ("units", UNITS), ("peaks", PEAKS)]
    with open(path, "w", newline="", encoding="utf-8", errors="replace") as f:
        f.write(f"{FIRST_LINE} {csv_comment(provenance.robot)}\n")
        f.writelines(f"# {name}: {csv_comment(text)}\n" for name, text in head)
        table = csv.DictWriter(f, [csv_text(name) for name in columns_of_rows(rows)], restval="", lineterminator="\n")
        table.writeheader()
        table.writerows(map(csv_row, rows))


def summary_table(rows: Sequence[SummaryRow], provenance: Provenance) -> pa.Table:
    """The summary's rows as a table; quantities that a joint doesn't have are null.  Metadata as in wrenches.parquet."""
    require("a table of the summary", "pyarrow")
    import pyarrow as pa

    rows = all_rows(rows)
    words = ("case", "joint", "kind", UNDETERMINED)
    names = columns_of_rows(rows)
    types = [pa.string() if name in words or name.endswith("_case") else pa.float64() for name in names]
    schema = pa.schema(list(zip(names, types, strict=True)), metadata={"ksl": json.dumps(provenance.metadata() | {"peaks": PEAKS})})
    return pa.Table.from_pydict({name: [row.get(name) for row in rows] for name in names}, schema=schema)
