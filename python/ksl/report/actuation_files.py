"""The files of `ksl actuation`: the page, tables of the maps and of the motion, and the serial model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ksl.base.arrow_files import arrow_file
from ksl.base.csv_cells import csv_comment, csv_table
from ksl.mechanism.states import Array
from ksl.output import refuse_inputs, refuse_unknown, staged
from ksl.report.actuation_page import write_actuation_page
from ksl.robot_files.mjcf_text import mjcf_text

if TYPE_CHECKING:
    import pyarrow as pa

    from ksl.report.actuation_results import ActuationResults

MARK = "maps.parquet"
FILES = ("report.html", MARK, "maps.csv", "motion.parquet", "motion.csv", "serial.urdf", "serial.xml", "closed.xml", "leg_maps.h", "leg_maps.c")


def write_actuation(run: ActuationResults, folder: Path, force: bool) -> list[str]:
    """As :meth:`ksl.ActuationRun.write`."""
    refuse_inputs([folder / name for name in FILES], [file.file for file in run.inputs])

    def refuse_others() -> None:
        if not (folder / MARK).is_file():
            refuse_unknown(folder, FILES, f"{MARK} of KSL")

    with staged(folder, FILES, None if force else refuse_others) as stage:
        write_actuation_page(stage / "report.html", run)
        _write_table(stage, "maps", maps_table(run), run)
        if run.motion is not None:
            _write_table(stage, "motion", motion_table(run), run)
        (stage / "serial.urdf").write_text(run.serial.to_urdf(), encoding="utf-8", newline="")
        for name, model in (("serial.xml", run.serial), ("closed.xml", run.actuation.model)):
            try:
                text = mjcf_text(model)
            except ValueError:  # MuJoCo lacks one of its joints; the page says so
                continue
            (stage / name).write_text(text, encoding="utf-8", newline="")
        for name, text in run.actuation.c_code("leg").items():
            (stage / name).write_text(text, encoding="ascii", newline="\n")
        return [name for name in FILES if (stage / name).is_file()]


def maps_table(run: ActuationResults) -> pa.Table:
    """A row for each position of each joint's curves: `along` is the joint; q, motors' positions, their velocities for one of the joint, and what follows."""
    import pyarrow as pa

    a = run.actuation
    columns: dict[str, list[Array]] = {}
    along: list[str] = []
    nothing = np.array([np.nan])
    for c in run.curves:
        n = len(c.q)
        along += [c.joint] * n
        found = {name: c.q[:, k] for k, name in enumerate(a.joints)}
        found |= {name: c.motors[:, k] for k, name in enumerate(a.motors)}
        found |= {f"{name}.ratio": c.ratios[:, k] for k, name in enumerate(a.motors)}
        numbers = {"effort_alone": c.effort, "effort_box": c.effort_box, "velocity_alone": c.velocity, "velocity_box": c.velocity_box}
        found |= {name: np.repeat(nothing, n) if x is None else x for name, x in numbers.items()}
        found |= {"rotor_inertia": c.rotors, "rod_inertia": c.rods, "distance_to_hold": c.distance}
        for name, x in found.items():
            columns.setdefault(name, []).append(x)
    return pa.table({"along": along} | {name: np.concatenate(parts) for name, parts in columns.items()})


def motion_table(run: ActuationResults) -> pa.Table:
    """A row for each sample: motors' positions, velocities, efforts and static efforts, and the force at each loop joint."""
    import pyarrow as pa

    assert run.motion is not None
    x, a = run.motion, run.actuation
    columns: dict[str, Array] = {"time": x.time}
    for k, name in enumerate(a.motors):
        columns |= {name: x.motors[:, k], f"{name}.v": x.speeds[:, k], f"{name}.effort": x.efforts[:, k], f"{name}.static_effort": x.static[:, k]}
    columns |= {f"{name}.force": x.forces[:, k] for k, name in enumerate(a.loops)}
    return pa.table(columns)


def _write_table(stage: Path, name: str, table: pa.Table, run: ActuationResults) -> None:
    import pyarrow
    import pyarrow.csv
    import pyarrow.parquet

    with arrow_file(stage / f"{name}.parquet", "wb") as out:
        pyarrow.parquet.write_table(table, out)
    rows = pyarrow.BufferOutputStream()
    pyarrow.csv.write_csv(csv_table(table), rows, pyarrow.csv.WriteOptions(quoting_style="needed"))
    a = run.actuation
    head = f"# {csv_comment(name + ' of ' + str(a.model.name))}\n"
    (stage / f"{name}.csv").write_bytes(head.encode("utf-8", "replace") + rows.getvalue().to_pybytes())
