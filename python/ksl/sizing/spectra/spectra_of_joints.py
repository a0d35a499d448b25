"""Load spectra of several joints, as tables and files."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ksl.base import workbooks
from ksl.base.csv_cells import csv_comment, csv_text
from ksl.base.errors import SizingError
from ksl.output import OutputError, refuse_inputs, refuse_unknown, staged
from ksl.sizing.life import BALL, ROLLER
from ksl.sizing.results import WRENCH
from ksl.sizing.spectra.bearing_classes import COLUMNS
from ksl.sizing.spectra.spectra import Spectra, cycles_in_classes

WORKBOOK = "spectra.xlsx"
FILES = ("bearings.csv", "durations.csv", "rainflow.csv", "spectra.json", WORKBOOK)
"""What `write` writes."""
CONVENTIONS = {
    "signs": "forces and moments on the child, about the point; torque and speed with their signs",
    "bearings": "x along the joint's axis; of an axis z, (x, y, z) are (z, x, y) of the joint's frame; share of the time, pauses included",
    "classes": "a class holds its lower edge, the last one its upper edge, too; classes without time or cycles are left out",
    "of": "times, revolutions and cycles are of one pass through all load cases as often as the components file says; of one hour where it has shares of the time",
    "rainflow": "ASTM E1049-85, 5.4.4; ranges, not amplitudes; what a case leaves open are half cycles; components in the joint's axes",
}
Table = tuple[list[str], list[str], list[list[Any]]]
"""Names, units and rows."""


class SpectraOfJoints(dict[str, Spectra]):
    """{joint: Spectra}, which can be written."""

    def __init__(self, found: Mapping[str, Spectra], robot: str, provenance: Mapping[str, Any], notes: tuple[str, ...] = ()) -> None:
        super().__init__(found)
        self.robot, self.provenance = robot, provenance
        self._notes = notes

    @property
    def notes(self) -> tuple[str, ...]:
        """What the reader should know: of the results, then of joints, each sentence once."""
        said = dict.fromkeys(note for s in self.values() for note in s.notes)
        return (*self._notes, *(f"{', '.join(name for name, s in self.items() if note in s.notes)}: {note}" for note in said))

    def as_dict(self, classes: int = 20) -> dict[str, Any]:
        """Everything in numbers and words, as JSON can hold it.  classes: of the bearings' loads, at most."""
        joints = {name: _of_joint(s, classes) for name, s in self.items()}
        return {**self.provenance, "robot": self.robot, "joints": joints, "notes": list(self.notes), "conventions": CONVENTIONS}

    def write(self, directory: str | Path, force: bool = False, xlsx: bool = False, classes: int = 20) -> list[str]:
        """Writes bearings.csv, durations.csv, rainflow.csv and spectra.json, completely or not at all; returns their names.

        classes: of the bearings' loads, at most.  xlsx: spectra.xlsx too, a sheet for each table and one for each bearing; needs the extra `ksl[xlsx]`.
        Raises SizingError where the folder holds spectra of another robot, unless it is forced; OutputError where it can't be written.
        """
        folder = Path(directory)
        if xlsx and (missing := workbooks.is_missing()):
            raise OutputError(f"{WORKBOOK}: {missing}")
        refuse_inputs([folder / name for name in FILES], [file["file"] for file in self.provenance.get("inputs", [])])
        tables = {"bearings": _bearings(self, classes), "durations": _durations(self), "rainflow": _rainflow(self)}
        with staged(folder, FILES, None if force else partial(_refuse_others, folder, self.robot)) as stage:
            for name, table in tables.items():
                (stage / f"{name}.csv").write_text(self._heading() + _csv(table), encoding="utf-8", errors="replace", newline="")
            (stage / "spectra.json").write_text(json.dumps(self.as_dict(classes), ensure_ascii=False, indent=1) + "\n", encoding="utf-8", errors="replace")
            if xlsx:
                self._write_workbook(stage / WORKBOOK, tables)
        return [name for name in FILES if xlsx or name != WORKBOOK]

    def _heading(self) -> str:
        p = self.provenance
        files = [f"{file['role']}: {file['file']}, SHA-256 {file['sha256']}" for file in p.get("inputs", [])]
        lines = [f"ksl {p.get('version', '')}, {p.get('date', '')}, robot {self.robot}", *files, *(f"{k}: {v}" for k, v in CONVENTIONS.items())]
        return "".join(f"# {csv_comment(line)}\n" for line in lines)

    def _write_workbook(self, path: Path, tables: Mapping[str, Table]) -> None:
        book = workbooks.new_workbook()
        for name, table in tables.items():
            workbooks.add_table(book, name, *table)
        for k, joint in enumerate(dict.fromkeys(row[0] for row in tables["bearings"][2]), 1):
            rows = [row[1:] for row in tables["bearings"][2] if row[0] == joint]
            workbooks.add_table(book, f"bearing {k}", tables["bearings"][0][1:], tables["bearings"][1][1:], rows)
        of = [[f"bearing {k}", joint] for k, joint in enumerate(dict.fromkeys(row[0] for row in tables["bearings"][2]), 1)]
        workbooks.add_lines(book, "About", [*of, *(line[2:].split(": ", 1) for line in self._heading().splitlines() if ": " in line)])
        workbooks.save(book, path)


def _of_joint(s: Spectra, classes: int) -> dict[str, Any]:
    """What is printed and written of one joint."""
    turns = s.samples.joint.turns
    loads = {f"p = {name}": {"torque": _number(s.equivalent(p)), **_loads(s, p)} for name, p in (("3", BALL), ("10/3", ROLLER))} if turns else {}
    found: dict[str, Any] = {"unit": "N m" if turns else "N", "oscillates": s.oscillates if turns else None, "equivalent": loads}
    found |= {"torque_edges": s.torque_edges.tolist(), "speed_edges": s.speed_edges.tolist(), "duration": s.duration.tolist()}
    if turns:
        found["revolutions"] = s.revolutions.tolist()
        found["bearing"] = {name: x.tolist() for name, x in s.bearing(classes).items()}
    return found


def _loads(s: Spectra, p: float) -> dict[str, float | None]:
    e = s.bearing_equivalent(p)
    return {name: None if name in s.left_open else _number(x) for name, x in e._asdict().items()}


def _number(x: float) -> float | None:
    return float(x) if np.isfinite(x) else None


def _bearings(found: Mapping[str, Spectra], classes: int) -> Table:
    rows = [[name, *row] for name, s in found.items() if s.samples.joint.turns for row in zip(*(x.tolist() for x in s.bearing(classes).values()))]
    return ["joint", *COLUMNS], ["", *COLUMNS.values()], rows


def _durations(found: Mapping[str, Spectra]) -> Table:
    names = ["joint", "torque_from", "torque_to", "torque_unit", "speed_from", "speed_to", "speed_unit", "duration", "revolutions"]
    rows = []
    for name, s in found.items():
        turns, duration = s.samples.joint.turns, s.duration
        turned = s.revolutions if turns else None
        for i, j in np.argwhere(duration > 0).tolist():
            torque, speed = s.torque_edges[i : i + 2].tolist(), s.speed_edges[j : j + 2].tolist()
            revolutions = None if turned is None else float(turned[i, j])
            rows.append([name, *torque, "N m" if turns else "N", *speed, "rad/s" if turns else "m/s", float(duration[i, j]), revolutions])
    return names, ["", "", "", "", "", "", "", "s", ""], rows


def _rainflow(found: Mapping[str, Spectra]) -> Table:
    rows = [[name, *row] for name, s in found.items() for row in _cycles(s)]
    return ["joint", "component", "unit", "range_from", "range_to", "mean_from", "mean_to", "cycles"], [""] * 8, rows


def _cycles(s: Spectra) -> Iterator[list[Any]]:
    for component in WRENCH:
        cycles = s.rainflow(component)
        ranges, means = s.rainflow_edges(cycles)
        counts = cycles_in_classes(cycles, ranges, means)
        for i, j in np.argwhere(counts > 0).tolist():
            edges = [*ranges[i : i + 2].tolist(), *means[j : j + 2].tolist()]
            yield [component, "N" if component[0] == "f" else "N m", *edges, float(counts[i, j])]


def _csv(table: Table) -> str:
    out = io.StringIO(newline="")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(table[0])
    writer.writerows([csv_text(x) if isinstance(x, str) else x for x in row] for row in table[2])
    return out.getvalue()


def _refuse_others(folder: Path, robot: str) -> None:
    """Refuses a folder with spectra of another robot, or with other files of these names."""
    try:
        said = json.loads((folder / "spectra.json").read_text(encoding="utf-8"))
        earlier = str(said["robot"]) if "joints" in said else None
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        earlier = None
    if earlier is None:
        refuse_unknown(folder, FILES, "spectra.json of KSL")
    elif earlier != robot:
        raise SizingError(f"{folder}: holds spectra of {earlier}, and these are of {robot}; give another folder with -o, or --force")
