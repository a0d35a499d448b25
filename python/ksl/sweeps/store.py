"""The folder of a sweep: partitions, each complete or absent; what made them; the worst cases."""

from __future__ import annotations

import csv
import hashlib
import json
import os
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ksl._core import __version__
from ksl.errors import SweepError
from ksl.load_cases.output import OutputError
from ksl.sweeps.evaluate import Plan, Result

MANIFEST = "sweep.json"
DATA_SETS = ("cases", "wrenches")


class Store:
    """Partitions in DIR/cases (and DIR/wrenches), as DIR/sweep.json describes them."""

    def __init__(self, directory: Path, plan: Plan, force: bool = False) -> None:
        """Opens the folder; what an earlier run of the same sweep has computed stays.  Raises SweepError if it holds another one."""
        self.directory, self.plan = directory, plan
        manifest = describe(plan)
        found = _read(directory / MANIFEST)
        if found is not None and found["fingerprint"] != manifest["fingerprint"]:
            if not force:
                raise SweepError(f"{directory}: holds another sweep ({_difference(found, manifest)}); give another folder with -o, or --force to replace it")
            _remove(directory)
            found = None
        try:
            for name in self._data_sets():
                (directory / name).mkdir(parents=True, exist_ok=True)
                for part in (directory / name).glob(".*.part"):  # of a run that was killed
                    part.unlink()
            if found is None:
                write_whole(directory / MANIFEST, json.dumps(manifest, indent=1).encode())
        except OSError as error:
            raise OutputError(f"{directory}: results can't be written there ({error.strerror}); give a folder that can be written with -o") from None

    def _data_sets(self) -> tuple[str, ...]:
        return DATA_SETS if self.plan.with_wrenches else DATA_SETS[:1]

    def _path(self, name: str, partition: int) -> Path:
        return self.directory / name / f"part-{partition:06}.parquet"

    def missing(self) -> list[int]:
        """Partitions that are still to be computed."""
        return [p for p in range(self.plan.partitions) if not all(self._path(name, p).exists() for name in self._data_sets())]

    def add(self, result: Result) -> None:
        """Writes a partition; its summary last, so that a partition that has one is complete."""
        for name in reversed(self._data_sets()):
            write_whole(self._path(name, result.partition), result.files[name])

    def worst(self) -> list[dict[str, Any]]:
        """The worst case of each joint and quantity, from all partitions; also written as worst.csv."""
        rows = worst_cases([self._path("cases", p) for p in range(self.plan.partitions)], [p.name for p in self.plan.sweep.parameters])
        text = _csv(rows)
        write_whole(self.directory / "worst.csv", text.encode())
        return rows


def describe(plan: Plan) -> dict[str, Any]:
    """What makes the results of a sweep: its fingerprint is the same if and only if they are."""
    sweep = plan.sweep
    files = [plan.robot, *([sweep.motion] if sweep.motion else []), *(str(v) for p in sweep.parameters if p.kind == "motion" for v in p.values)]
    made_by = {
        "version": __version__,
        "inputs": [{"file": os.path.basename(f), "sha256": _sha256(f)} for f in files],
        "base": dict(sweep.base),
        "sampling": {"kind": sweep.sampling, "cases": sweep.cases, "seed": sweep.seed if sweep.sampling != "grid" else None},
        "parameters": [{**{k: v for k, v in vars(p).items() if p.kind != "motion" or k != "values"}, "unit": p.unit} for p in sweep.parameters],
        "partition": plan.size,
        "wrenches": plan.with_wrenches,
        "units": "SI: N, N m, rad, m, s, W, J; payload kg, tilt deg; position_share, speed_share and effort_share are 1 at the limit",
    }
    return {"fingerprint": hashlib.sha256(json.dumps(made_by, sort_keys=True).encode()).hexdigest(), **made_by}


def worst_cases(files: Sequence[Path], parameters: Sequence[str]) -> list[dict[str, Any]]:
    """For each joint and each peak or share its largest value, and the case, with the values of its parameters."""
    import pyarrow.parquet

    best: dict[tuple[str, str], tuple[float, dict[str, Any]]] = {}
    for file in files:
        table = pyarrow.parquet.read_table(file)
        quantities = [name for name in table.column_names if name.endswith(("_peak", "_share", "_rms"))]
        joints = np.array(table["joint"].to_pylist())
        for joint in dict.fromkeys(joints):
            rows = np.flatnonzero(joints == joint)
            for quantity in quantities:
                x = table[quantity].to_numpy()[rows]
                if np.isnan(x).all():
                    continue
                k = int(np.nanargmax(x))
                if (joint, quantity) not in best or x[k] > best[joint, quantity][0]:
                    best[joint, quantity] = (float(x[k]), {name: table[name][int(rows[k])].as_py() for name in ("case", *parameters)})
    return [{"joint": joint, "quantity": quantity, "value": value, **case} for (joint, quantity), (value, case) in best.items()]


def write_whole(path: Path, contents: bytes) -> None:
    """Writes a file that is there completely or not at all."""
    part = path.with_name(f".{path.name}.part")
    try:
        part.write_bytes(contents)
        os.replace(part, path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise OutputError(f"{path}: can't be written ({error.strerror}); free some space, or give another folder with -o") from None
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def _csv(rows: Sequence[Mapping[str, Any]]) -> str:
    import io

    text = io.StringIO(newline="")
    table = csv.DictWriter(text, list(rows[0]) if rows else ["joint", "quantity", "value"], lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    return text.getvalue()


def _sha256(file: str) -> str:
    try:
        with open(file, "rb") as contents:
            return hashlib.file_digest(contents, "sha256").hexdigest() if hasattr(hashlib, "file_digest") else hashlib.sha256(contents.read()).hexdigest()
    except OSError as error:
        raise SweepError(f"{file}: can't be read ({error.strerror}); check its name in the sweep") from None


def _read(path: Path) -> dict[str, Any] | None:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        return found if isinstance(found, dict) and "fingerprint" in found else None
    except FileNotFoundError:
        return None
    except (OSError, ValueError):
        raise SweepError(f"{path}: is not the description of a sweep; remove it, or give another folder with -o") from None


def _difference(found: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    names = {"version": "made by another version of KSL", "inputs": "of other files", "sampling": "with other cases", "parameters": "of other parameters"}
    different = [text for key, text in names.items() if found.get(key) != wanted[key]]
    return different[0] if different else "made with other options"


def _remove(directory: Path) -> None:
    for name in DATA_SETS:
        shutil.rmtree(directory / name, ignore_errors=True)
    for name in (MANIFEST, "worst.csv"):
        (directory / name).unlink(missing_ok=True)
