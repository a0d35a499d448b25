"""Joint states as `rostopic echo -p TOPIC` prints them: a CSV file with the names of the joints in every row, read as a bag is."""

from __future__ import annotations

import re
from collections.abc import Iterator
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np

from ksl.motions.columns.time_column import TIME
from ksl.motions.files.joint_states import SECOND, JointStates, JointStateTable

if TYPE_CHECKING:
    from ksl.motions.files.csv_table import CsvTable

_FIELD = re.compile(r"field\.(name|position|velocity|effort)(\d+)")
LOG, STAMP = "time", "field.header.stamp"


def is_joint_states(table: CsvTable) -> bool:
    return {LOG, "field.name0", "field.position0"} <= set(table.names)


def joint_states(table: CsvTable, positions_only: bool) -> JointStateTable:
    """The joint states of the file.  Raises MotionError."""
    columns: dict[str, list[str]] = {"name": [], "position": [], "velocity": [], "effort": []}
    for name in table.names:
        if found := _FIELD.fullmatch(name):
            columns[found[1]].append(name)
    texts = table.read_texts(columns["name"])
    numbers = table.read([*columns["position"], *columns["velocity"], *columns["effort"]])
    times = table.read_integers([LOG] + [STAMP] * (STAMP in table.names))
    rows_named = max((k + 1 for k in range(len(texts[0])) if any(column[k] for column in texts)), default=0)  # blank lines at the end name none
    numbers = {c: np.append(x, np.full(max(rows_named - len(x), 0), np.nan)) for c, x in numbers.items()}  # `read` drops rows without numbers there

    def messages() -> Iterator[tuple[int, SimpleNamespace]]:
        for k in range(rows_named):
            names = [column[k] for column in texts if column[k]]
            rows = {part: np.array([numbers[c][k] for c in columns[part][: len(names)]]) for part in ("position", "velocity", "effort")}
            stamp = times[1][k] if STAMP in table.names else 0
            header = SimpleNamespace(stamp=SimpleNamespace(sec=stamp // SECOND, nanosec=stamp % SECOND))
            yield times[0][k], SimpleNamespace(name=names, header=header, **rows)

    read = JointStateTable(JointStates(table.file, "joint states", messages()), f"{table.format} of rostopic", positions_only)
    read.aliases = _aliases(columns, texts)
    read.notes[:0] = table.notes
    read.doubts += table.doubts
    return read


def _aliases(columns: dict[str, list[str]], texts: list[list[str]]) -> dict[str, str]:
    """Columns of the file by the joints whose numbers they hold; empty texts where these change from row to row."""
    of_number = {name.removeprefix("field.name"): {row for row in column if row} for name, column in zip(columns["name"], texts)}
    found = dict.fromkeys((LOG, f"%{LOG}", STAMP), TIME)
    for part, end in (("position", ""), ("velocity", ".v")):
        for name in columns[part]:
            joints = of_number.get(name.removeprefix(f"field.{part}"), set())
            found[name] = f"{next(iter(joints))}{end}" if len(joints) == 1 else ""
    return found
