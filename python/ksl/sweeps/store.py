"""The folder of a sweep: partitions, each complete or absent; what made them; the worst cases."""

from __future__ import annotations

import atexit
import contextlib
import csv
import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np

from ksl._core import __version__
from ksl.base.arrow_files import arrow_file, with_text
from ksl.base.csv_cells import csv_row, csv_text
from ksl.base.errors import SweepError
from ksl.base.files_read import InputFile
from ksl.load_cases.quantities import UNDETERMINED, unit
from ksl.mechanism.mechanism import Joint
from ksl.output import OutputError, cannot_write, refuse_inputs
from ksl.output.folders import MadeFolders
from ksl.output.locks import Lock, LockedError, lock
from ksl.output.part_files import remove_parts, write_part
from ksl.output.signals import uninterrupted
from ksl.sweeps.description import described
from ksl.sweeps.evaluate import CONVENTIONS_OF_SWEEPS, UNITS_OF_SWEEPS, Plan, Result, portable
from ksl.sweeps.given_model import GivenModel

if TYPE_CHECKING:
    import pyarrow as pa

MANIFEST = "sweep.json"
WORST = "worst.csv"
LOCK = ".ksl-sweep"
DATA_SETS = ("cases", "wrenches")
OF_WORST = ("_peak", "_rms", "_share", "utilisation")
"""Ends of the names of quantities that worst.csv has."""


class Store:
    """Partitions in DIR/cases (and DIR/wrenches), as DIR/sweep.json describes them.  A context manager: one process at a time may write into DIR."""

    def __init__(self, directory: Path, plan: Plan, force: bool = False) -> None:
        """force: if the folder holds another sweep, it is removed from it."""
        self.directory, self.plan, self._force = directory, plan, force
        self._lock: Lock | None = None
        self._made = MadeFolders()

    def __enter__(self) -> Store:
        """Opens the folder; what an earlier run of the same sweep has computed stays.

        Raises SweepError if it holds another sweep, or if another run is writing into it.
        """
        manifest = describe(self.plan)
        refuse_inputs(
            [self.directory / MANIFEST, self.directory / WORST],
            [f.file for f in _inputs(self.plan) if not (f.role == "robot" and isinstance(self.plan.robot, GivenModel))],
        )
        atexit.register(self._close)  # a signal may come when the folder has been opened and the block not yet entered
        try:
            try:
                with uninterrupted():
                    self._made.make(self.directory)
                    self._lock = lock(self.directory / LOCK)
                self._open(manifest)
            except BaseException:
                self._close()
                raise
        except LockedError as holder:
            raise SweepError(f"{self.directory}: {holder} is running a sweep into this folder; wait for its end, or give another folder with -o") from None
        except OutputError:
            raise
        except OSError as error:
            raise OutputError(f"{self.directory}: {cannot_write(error)}") from None
        return self

    def __exit__(self, error: type[BaseException] | None, value: BaseException | None, traceback: TracebackType | None) -> None:
        self._close()

    def _open(self, manifest: Mapping[str, Any]) -> None:
        found = _read(self.directory / MANIFEST)
        if found is not None and found["fingerprint"] != manifest["fingerprint"]:
            if not self._force:
                different = _difference(found, manifest)
                raise SweepError(f"{self.directory}: holds another sweep ({different}); give another folder with -o, or --force to replace it")
            _remove(self.directory)
            found = None
        if found is None:
            self._refuse_unknown()
        for name in ("", *DATA_SETS):
            remove_parts(self.directory / name)  # of a run that was killed
        for name in self._data_sets():
            with uninterrupted():
                self._made.make(self.directory / name)
        if found is None:
            write_part(self.directory / MANIFEST, json.dumps(manifest, indent=1).encode())

    def _close(self) -> None:
        """Releases the folder.  Folders that were made and are still empty are removed: a sweep that was refused leaves nothing."""
        with uninterrupted():
            if self._lock is not None:
                self._lock.release()
                self._lock = None
            self._made.remove_empty()
            atexit.unregister(self._close)

    def _refuse_unknown(self) -> None:
        """Partitions without a description may be of any sweep: they would be taken for those of this one."""
        for name in DATA_SETS:
            if any((self.directory / name).glob("part-*.parquet")):
                raise SweepError(f"{self.directory / name}: holds partitions, but {MANIFEST} beside it is missing; remove them, or give another folder with -o")
        if os.path.lexists(self.directory / WORST):
            raise SweepError(f"{self.directory / WORST}: is there, but {MANIFEST} beside it is missing; move it away, or give another folder with -o")

    def _data_sets(self) -> tuple[str, ...]:
        return DATA_SETS if self.plan.with_wrenches else DATA_SETS[:1]

    def _path(self, name: str, partition: int) -> Path:
        return self.directory / name / f"part-{partition:06}.parquet"

    def missing(self) -> list[int]:
        """Partitions that are still to be computed."""
        return [p for p in range(self.plan.partitions) if not all(self._path(name, p).exists() for name in self._data_sets())]

    def remove_others(self) -> int:
        """Removes partitions that were computed from other contents of the files than this sweep; how many they were."""
        found, removed = portable(self.plan.inputs), 0
        for p in range(self.plan.partitions):
            files = [file for name in self._data_sets() if (file := self._path(name, p)).exists()]
            if any(_made_of(file) != found for file in files):
                removed += 1
                for file in files:  # the summary first: without it a partition is not complete
                    file.unlink()
        return removed

    def add(self, result: Result) -> None:
        """Writes a partition; its summary last, so that a partition that has one is complete."""
        for name in reversed(self._data_sets()):
            write_part(self._path(name, result.partition), result.files[name])

    def worst(self, joints: Sequence[Joint]) -> list[dict[str, Any]]:
        """The worst case of each joint and quantity, from all partitions; also written as worst.csv."""
        files = [self._path("cases", p) for p in range(self.plan.partitions)]
        rows = worst_cases(files, [p.name for p in self.plan.sweep.parameters], joints)
        text = _csv(rows)
        write_part(self.directory / WORST, text.encode())
        return rows


def describe(plan: Plan) -> dict[str, Any]:
    """What makes the results of a sweep: its fingerprint is the same if and only if they are."""
    sweep = plan.sweep
    made_by = {
        "version": __version__,
        "inputs": portable(_inputs(plan)),
        "base": {**sweep.base, "reading": sweep.reading},
        "sampling": {"kind": sweep.sampling, "cases": sweep.cases, "seed": sweep.seed if sweep.sampling != "grid" else None},
        "parameters": described(sweep),
        "partition": plan.size,
        "wrenches": plan.with_wrenches,
        "units": UNITS_OF_SWEEPS,
        "conventions": CONVENTIONS_OF_SWEEPS,
    }
    made_by = json.loads(json.dumps(made_by, default=_plain))  # a program may give arrays
    return {"fingerprint": hashlib.sha256(json.dumps(made_by, sort_keys=True).encode()).hexdigest(), **made_by}


def _inputs(plan: Plan) -> Sequence[InputFile]:
    for f in plan.inputs:
        if f.sha256 is None:  # the results could not be told from those of another file
            raise SweepError(f"{f.file}: can't be read again; a sweep needs its {f.role} as a file")
    return plan.inputs


def _made_of(file: Path) -> Any:
    """The inputs of a partition, as its metadata say them; None where they don't."""
    import pyarrow as pa
    import pyarrow.parquet

    try:
        with arrow_file(file) as opened:
            return json.loads((pyarrow.parquet.read_schema(opened).metadata or {})[b"ksl"]).get("inputs")
    except (OSError, pa.ArrowInvalid):
        raise _damaged(file) from None
    except (KeyError, ValueError, AttributeError):
        return None


def _damaged(file: Path) -> SweepError:
    return SweepError(f"{file}: is damaged; remove it, and run the sweep again: only its cases are then computed")


def _plain(x: Any) -> Any:
    return x.tolist() if hasattr(x, "tolist") else str(x)


def worst_cases(files: Sequence[Path], parameters: Sequence[str], joints: Sequence[Joint]) -> list[dict[str, Any]]:
    """For each joint and each peak, root mean square or share its largest value, its unit, and the case, with the values of its parameters."""
    best: dict[tuple[str, str], tuple[float, dict[str, Any]]] = {}
    for file in files:
        table = _table(file)
        quantities = [name for name in table.column_names if name not in parameters and name.endswith(tuple(OF_WORST)) and not name.endswith("_at_peak")]
        for i, joint in enumerate(joints):
            for quantity in quantities:
                x = table[quantity].to_numpy()[i :: len(joints)]  # each case has a row for each joint, in order
                if np.isnan(x).all():
                    continue
                k = int(np.nanargmax(x))
                if (joint.name, quantity) not in best or x[k] > best[joint.name, quantity][0]:
                    case = {name: table[name][i + k * len(joints)].as_py() for name in ("case", *parameters)}
                    if UNDETERMINED in table.column_names:  # whether the number uses components that rigid bodies leave open
                        words = table[UNDETERMINED][i + k * len(joints)].as_py().split()
                        case[UNDETERMINED] = "yes" if quantity.rpartition("_")[0] in words else "no"
                    best[joint.name, quantity] = (float(x[k]), case)
    by_name = {j.name: j for j in joints}
    return [
        {"joint": joint, "quantity": quantity, "value": value, "unit": _unit(quantity, by_name[joint]), **best[joint, quantity][1]}
        for joint in by_name
        for quantity, (value, _) in ((q, found) for (of, q), found in best.items() if of == joint)
    ]


def _table(file: Path) -> pa.Table:
    import pyarrow as pa
    import pyarrow.parquet

    try:
        with arrow_file(file) as opened:
            return with_text(pyarrow.parquet.read_table(opened))
    except (OSError, pa.ArrowInvalid):
        raise _damaged(file) from None


def _unit(quantity: str, joint: Joint) -> str:
    """The unit of a peak or root mean square; empty for shares of limits and utilisations."""
    name, _, part = quantity.rpartition("_")
    return "" if part in ("share", "utilisation") else unit(name, joint)


def _csv(rows: Sequence[Mapping[str, Any]]) -> str:
    import io

    text = io.StringIO(newline="")
    table = csv.DictWriter(text, [csv_text(name) for name in rows[0]] if rows else ["joint", "quantity", "value", "unit"], lineterminator="\n")
    table.writeheader()
    table.writerows(map(csv_row, rows))
    return text.getvalue()


def _read(path: Path) -> dict[str, Any] | None:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        if isinstance(found, dict) and "fingerprint" in found:
            return found
        raise ValueError
    except (FileNotFoundError, NotADirectoryError):  # of the second the folder's error is clearer
        return None
    except (OSError, ValueError):
        raise SweepError(f"{path}: is not the description of a sweep; move it away, or give another folder with -o") from None


def _difference(found: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    names = {"version": "made by another version of KSL", "sampling": "with other cases", "parameters": "of other parameters"}
    names["inputs"] = _other_files(found.get("inputs"), wanted["inputs"])
    different = [text for key, text in names.items() if found.get(key) != wanted[key]]
    return different[0] if different else "made with other options"


def _other_files(found: Any, wanted: Sequence[Mapping[str, Any]]) -> str:
    known = found if isinstance(found, list) else []
    others = [str(f["file"]) for f in wanted if f not in known]
    return f"of other files: {', '.join(others[:3])}{', …' if len(others) > 3 else ''} had other contents" if others else "of other files"


def _remove(directory: Path) -> None:
    """Removes a sweep.  Its description is removed last: it still describes what a process leaves that is killed on the way."""
    (directory / WORST).unlink(missing_ok=True)
    for name in DATA_SETS:
        for file in (directory / name).glob("part-*.parquet"):
            file.unlink(missing_ok=True)
        remove_parts(directory / name)
        with contextlib.suppress(OSError):  # it is not there, or holds files of others
            (directory / name).rmdir()
    (directory / MANIFEST).unlink(missing_ok=True)
