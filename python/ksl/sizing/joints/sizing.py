"""The result of `ksl.size`: figures, the simultaneous sets, what is left out; as tables and files."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from ksl.base import workbooks
from ksl.base.arrow_files import arrow_file
from ksl.base.csv_cells import csv_comment, csv_table
from ksl.base.errors import SizingError
from ksl.base.markup import html as escape
from ksl.output import OutputError, refuse_inputs, refuse_unknown, staged
from ksl.sizing.choice.selection import Chosen, Selection
from ksl.sizing.figures import Figure, LeftOut, significant
from ksl.sizing.utilisation.motor_figures import Cloud
from ksl.sizing.peaks import QUANTITIES, PeakRow

if TYPE_CHECKING:
    import pyarrow as pa

WORKBOOK = "sizing.xlsx"
CHOICES = ("choices.parquet", "choices.csv")
FILES = ("sizing.parquet", "sizing.csv", "sizing.json", "peaks.parquet", "peaks.csv", *CHOICES, WORKBOOK)
"""What `write` writes."""

CONVENTIONS = {
    "utilisation": "1 is at the limit, more is beyond it; none where there is nothing to compare with",
    "units": "of figures in the column unit, of value and limit; of peaks in the fields, rad or m as the column unit says; time s",
    "signs": "forces and moments on the child side, about the point, in the joint's axes; axial along the joint's axis, z for fixed joints",
    "cycle": "all cases one after the other, each as often as the components file says, otherwise once",
}


@dataclass(frozen=True)
class Sizing:
    """Figures of all components, worst first, and the simultaneous sets at the peaks of each joint."""

    robot: str
    figures: tuple[Figure, ...]
    """Sorted by utilisation, the largest first; those without one at the end."""
    peaks: tuple[PeakRow, ...]
    left_out: tuple[LeftOut, ...] = ()
    notes: tuple[str, ...] = ()
    clouds: tuple[Cloud, ...] = ()
    """Torque over speed of each motor."""
    in_order: tuple[Figure, ...] = ()
    """All figures in the order in which they are computed: components in the order of the file, each from loads to verdicts."""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    """Version, date, files with their SHA-256, cases with repetitions."""
    selection: Selection | None = None
    """What was chosen from a catalogue, with the reasons; None where nothing was."""

    @property
    def choices(self) -> tuple[Chosen, ...]:
        """The entry of the catalogue that was chosen for each table [[choose]], in their order."""
        return self.selection.choices if self.selection else ()

    @property
    def rounds(self) -> int:
        """How often all joints were chosen for, the last time without a change; 0 without a catalogue."""
        return self.selection.rounds if self.selection else 0

    @property
    def settled(self) -> bool:
        """Whether the choice changes no more: false where its masses lead it round in circles."""
        return self.selection.settled if self.selection else True

    @property
    def worst(self) -> Figure | None:
        """The figure with the largest utilisation; None where nothing was compared."""
        return self.figures[0] if self.figures and self.figures[0].utilisation is not None else None

    @property
    def exceeded(self) -> tuple[Figure, ...]:
        """Figures with a utilisation above 1."""
        return tuple(f for f in self.figures if f.verdict == "over")

    @property
    def level(self) -> Literal["green", "amber", "red"]:
        """Red where a figure is over its limit; amber where one is near it or left out, or nothing was compared; else green."""
        if self.exceeded:
            return "red"
        doubtful = self.left_out or self.worst is None or any(figure.verdict == "near" for figure in self.figures)
        return "amber" if doubtful else "green"

    @property
    def verdict(self) -> str:
        """One sentence."""
        compared = sum(f.utilisation is not None for f in self.figures)
        if self.worst is None:
            return f"{self.robot}: nothing was compared with a limit" if self.figures or self.left_out else f"{self.robot}: no components"
        w = self.worst
        over = (
            f"{len(self.exceeded)} of {compared} figures {'is over its' if len(self.exceeded) == 1 else 'are over their'} limit"
            if self.exceeded
            else f"all {compared} figures with a limit are within it"
        )
        missing = f"; {len(self.left_out)} left out" if self.left_out else ""
        return f"{self.robot}: {over}{missing}; worst: {w.joint}, {w.component}, {w.figure}, utilisation {significant(w.utilisation, 3)}"

    def of_joint(self, joint: str) -> tuple[Figure, ...]:
        """The figures of one joint, as they are computed."""
        return tuple(f for f in self.in_order if f.joint == joint)

    @cached_property
    def table(self) -> pa.Table:
        """The figures, one a row, with units and conventions in the metadata (key `ksl`)."""
        import pyarrow as pa

        columns = {f.name: [getattr(row, f.name) for row in self.figures] for f in dataclasses.fields(Figure)}
        numbers = ("value", "limit", "utilisation", "time")
        schema = pa.schema([pa.field(n, pa.float64() if n in numbers else pa.string()) for n in columns], metadata=self._metadata())
        return pa.table(columns, schema=schema)

    @cached_property
    def peak_table(self) -> pa.Table:
        """The simultaneous sets, one a row."""
        import pyarrow as pa

        names = ["joint", "extreme", *QUANTITIES, "unit", "case", "time", "point"]
        fields = [
            pa.field(n, pa.float64() if n in (*QUANTITIES, "time") else pa.string(), metadata={"unit": QUANTITIES[n]} if n in QUANTITIES else None)
            for n in names
        ]
        return pa.table({n: [row[n] for row in self.peaks] for n in names}, schema=pa.schema(fields, metadata=self._metadata()))

    def _metadata(self) -> dict[str, str]:
        return {"ksl": json.dumps({**self.provenance, "robot": self.robot, **CONVENTIONS, "left_out": [str(x) for x in self.left_out]})}

    def as_dict(self) -> dict[str, Any]:
        """Everything in numbers and words, as JSON can hold it; infinite numbers are the word "infinite"."""
        worst = self.worst
        return {
            **self.provenance,
            "robot": self.robot,
            "verdict": self.verdict,
            "worst": None if worst is None else _plain(dataclasses.asdict(worst)),
            "figures": [_plain(dataclasses.asdict(f)) for f in self.figures],
            "peaks": [_plain(row) for row in self.peaks],
            "left_out": [dataclasses.asdict(x) for x in self.left_out],
            "notes": list(self.notes),
            **({"choice": _finite(self.selection.as_dict())} if self.selection else {}),
            "conventions": CONVENTIONS,
        }

    def write(self, directory: str | Path, force: bool = False, xlsx: bool = False) -> list[str]:
        """Writes sizing.parquet, .csv and .json, peaks.parquet and .csv, completely or not at all; returns their names.

        Where components were chosen, choices.parquet and .csv too.  xlsx: sizing.xlsx too, a sheet for each table with units; needs the extra `ksl[xlsx]`.

        Raises SizingError where the folder holds the sizing of another robot, unless it is forced; OutputError (an OSError)
        where it can't be written, where it holds files of others with these names (unless it is forced), or the components' file.
        """
        import pyarrow.parquet

        folder = Path(directory)
        if xlsx and (missing := workbooks.is_missing()):
            raise OutputError(f"{WORKBOOK}: {missing}")
        refuse_inputs([folder / name for name in FILES], [file["file"] for file in self.provenance.get("inputs", [])])

        def refuse_others() -> None:
            earlier = _robot_of(folder / "sizing.json")
            if earlier is None:
                refuse_unknown(folder, FILES, "sizing.json of KSL")
            elif earlier != self.robot:
                raise SizingError(f"{folder}: holds the sizing of {earlier}, and this is {self.robot}; give another folder with -o, or --force")

        head = "".join(f"# {csv_comment(line)}\n" for line in self._headlines()).encode("utf-8", "replace")
        with staged(folder, FILES, None if force else refuse_others) as stage:
            for name, table in self._tables.items():
                with arrow_file(stage / f"{name}.parquet", "wb") as out:
                    pyarrow.parquet.write_table(table, out)
                (stage / f"{name}.csv").write_bytes(head + _csv(table))
            (stage / "sizing.json").write_text(json.dumps(self.as_dict(), ensure_ascii=False, indent=1) + "\n", encoding="utf-8", errors="replace")
            if xlsx:
                self._write_workbook(stage / WORKBOOK)
        return [name for name in FILES if (xlsx or name != WORKBOOK) and (self.choices or name not in CHOICES)]

    @property
    def _tables(self) -> dict[str, pa.Table]:
        import pyarrow as pa

        chosen = {"choices": pa.Table.from_pylist(self.selection.as_rows())} if self.selection else {}
        return {"sizing": self.table, "peaks": self.peak_table, **chosen}

    def _write_workbook(self, path: Path) -> None:
        book = workbooks.new_workbook()
        for title, table in self._tables.items():
            units = [(field.metadata or {}).get(b"unit", b"s" if field.name == "time" else b"").decode() for field in table.schema]
            workbooks.add_table(book, title.capitalize(), table.column_names, units, zip(*(column.to_pylist() for column in table.columns)))
        workbooks.add_lines(book, "About", [line.split(": ", 1) for line in [f"made by: {self._headlines()[0]}", *self._headlines()[1:]]])
        workbooks.save(book, path)

    def _headlines(self) -> list[str]:
        p = self.provenance
        files = [f"{said['role']}: {said['file']}, SHA-256 {said['sha256']}" for said in p.get("inputs", [])]
        return [f"ksl {p.get('version', '')}, {p.get('date', '')}, robot {self.robot}", *files, *(f"{k}: {v}" for k, v in CONVENTIONS.items())]

    def __repr__(self) -> str:
        lines = [f"Sizing of {self.verdict}"]
        lines += [f"  chosen for {c.joint}: {c.kind} {c.name}, {significant(c.utilisation, 3)} ({c.figure}); next smaller: {c.why}" for c in self.choices]
        for f in self.figures[:12]:
            lines.append(f"  {significant(f.utilisation, 3):>6}  {f.joint}  {f.component}  {f.figure}  {significant(f.value)} {f.unit}".rstrip())
        if len(self.figures) > 12:
            lines.append(f"  … and {len(self.figures) - 12} more in .figures and .table")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """For notebooks: the verdict and a table of what was compared."""
        names = ("utilisation", "joint", "component", "figure", "value", "limit", "governs")
        head = "".join(f"<th>{name}</th>" for name in names)
        colours = {"over": "#c0392b", "near": "#b7950b"}
        rows = []
        for f in (f for f in self.figures if f.utilisation is not None):
            when = f.case if f.time is None else f"{f.case}, {significant(f.time, 6)} s"
            limit = "" if f.limit is None else f"{f.bound} {significant(f.limit)}"
            cells = (significant(f.utilisation, 3), f.joint, f.component, f.figure, f"{significant(f.value)} {f.unit}".strip(), limit, when)
            style = f' style="color:{colours[f.verdict]}"' if f.verdict in colours else ""
            rows.append(f"<tr{style} title='{escape(f'{f.formula}; {f.inputs}; {f.source}')}'>" + "".join(f"<td>{escape(c)}</td>" for c in cells) + "</tr>")
        return f"<p>{escape(self.verdict)}</p><table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def _csv(table: pa.Table) -> bytes:
    import pyarrow as pa
    import pyarrow.csv

    rows = pa.BufferOutputStream()
    pyarrow.csv.write_csv(csv_table(table), rows, pyarrow.csv.WriteOptions(quoting_style="needed"))
    return bytes(rows.getvalue().to_pybytes())


def _finite(x: Any) -> Any:
    """Without infinite numbers, inside of tables and lists, too."""
    if isinstance(x, Mapping):
        return {k: _finite(v) for k, v in x.items()}
    if isinstance(x, (list, tuple)):
        return [_finite(v) for v in x]
    return "infinite" if isinstance(x, float) and math.isinf(x) else x


def _plain(row: Mapping[str, Any]) -> dict[str, Any]:
    return dict(_finite(row))


def _robot_of(file: Path) -> str | None:
    """Whose sizing a folder holds; None if none."""
    try:
        said = json.loads(file.read_text(encoding="utf-8"))
        return str(said["robot"]) if "figures" in said else None
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
