"""Writes a motion as a table that `ksl loads` reads: CSV or Parquet, by the suffix of its name."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Literal

import numpy as np

from ksl._core import __version__
from ksl.base.arrow_files import arrow_file
from ksl.base.csv_cells import csv_text
from ksl.base.errors import MotionError
from ksl.base.extras import require
from ksl.mechanism.mechanism import Joint, Mechanism
from ksl.mechanism.joint_kinds import columns_of
from ksl.mechanism.requests import one_of
from ksl.mechanism.states import Array
from ksl.motions.closed_motion import leading, moving_joints
from ksl.motions.generate.generated import Generated
from ksl.output import whole_file

DIGITS = 15


def write_motion(model: Mechanism, generated: Generated, path: str | os.PathLike[str], joints: Literal["all", "drives"] = "all") -> None:
    """`time`, positions, velocities and accelerations of all moving joints; of a template the positions alone.

    joints: "drives" writes those of the joints that the others of a closed mechanism follow, its drives and what floats; `ksl loads` needs no more.
    The file is written completely or not at all, in a folder that exists.  Parquet holds, under the key `ksl` of its metadata, how the motion was made.
    Raises MotionError for other suffixes, OutputError where it can't be written.
    """
    file = Path(path)
    if file.suffix.lower() not in (".csv", ".parquet"):
        raise MotionError(f"{file}: unknown suffix {file.suffix!r}; give a name that ends in .csv or .parquet")
    columns = _columns(model, generated, written_joints(model, generated, joints))
    with whole_file(file) as part:
        if file.suffix.lower() == ".csv":
            with open(part, "w", encoding="utf-8", newline="\n") as out:
                out.write(",".join(_quoted(name) for name in columns) + "\n")
                np.savetxt(out, np.column_stack(list(columns.values())), fmt=f"%.{DIGITS}g", delimiter=",")
        else:
            require("Parquet", "pyarrow")
            import pyarrow as pa
            import pyarrow.parquet as pq

            how = {"robot": model.name, "version": __version__, "units": "s, rad, m", **generated.facts}
            with arrow_file(part, "wb") as out:
                pq.write_table(pa.table(columns).replace_schema_metadata({"ksl": json.dumps(how)}), out, compression="zstd")


def written_joints(model: Mechanism, generated: Generated, joints: Literal["all", "drives"] = "all") -> tuple[Joint, ...]:
    """The joints whose columns are written.  Raises MotionError for drives of a robot without loops, of which all joints are."""
    if one_of(joints, "joints", "all", "drives") == "all" and generated.facts.get("kind") != "template":
        return moving_joints(model)
    if joints == "drives" and not model.loops:
        raise MotionError(f"{model.name} has no loops, so that no joint follows its drives; write the columns of all joints")
    return leading(model)


def _columns(model: Mechanism, generated: Generated, joints: tuple[Joint, ...]) -> dict[str, Array]:
    motion = generated.motion
    columns = {"time": motion.time}
    is_template = generated.facts.get("kind") == "template"
    for k, x in enumerate((motion.q, motion.v, motion.a)):
        if k and is_template:
            break
        for joint in joints:
            first = joint.q_index if k == 0 else joint.v_index
            for i, name in enumerate(columns_of(joint)[k]):
                if name in columns:
                    raise MotionError(
                        f"{model.name}: two columns would be called {name!r}, one of them for joint {joint.name!r}; rename that joint in the robot's file"
                    )
                columns[name] = x[:, first + i]
    return columns


def _quoted(name: str) -> str:
    cell = csv_text(name)
    return '"' + cell.replace('"', '""') + '"' if any(c in cell for c in ',"\n') else cell
