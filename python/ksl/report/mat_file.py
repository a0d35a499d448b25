"""wrenches.mat: every wrench as arrays, for MATLAB and Octave."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ksl.base.words import count
from ksl.load_cases.load_case import LoadCase
from ksl.load_cases.provenance import CONVENTIONS, UNITS, Provenance
from ksl.load_cases.reaction_joints import has_drive
from ksl.output import OutputError

FILE = "wrenches.mat"
MOST_BYTES = (1 << 31) - 1
"""Bytes of one array in a file of version 5, which scipy writes."""


def write_mat(path: Path, cases: Sequence[LoadCase], provenance: Provenance) -> None:
    """A variable `ksl` with the fields robot, joints (names), components, cases, made_of, units and conventions.

    `ksl.cases(i)` has name, time (n, 1), wrench (n, joints, 6), expressed as the results are, and position, speed, acceleration and effort (n, joints), NaN where
    a joint has none.  Raises OutputError where an array is too large for such files.  O(numbers), all of them in memory.
    """
    from scipy.io import savemat

    first = cases[0]
    wanted = [k for k, j in enumerate(first.joints) if first.placement.wanted(j.name)]
    largest = max(len(case.motion.time) for case in cases)
    if largest * len(wanted) * 48 > MOST_BYTES:
        raise OutputError(
            f"{FILE}: {count(largest, 'sample')} of {count(len(wanted), 'joint')} are more than such a file holds in one array; leave out --mat, or take --joints"
        )
    p, computed = first.placement, [_case(case, wanted) for case in cases]
    components = ["fx", "fy", "fz", "tx", "ty", "tz"] if p.order == "lin_ang" else ["tx", "ty", "tz", "fx", "fy", "fz"]
    said: dict[str, Any] = {
        "robot": provenance.robot,
        "joints": _names([first.joints[k].name for k in wanted]),
        "components": _names(components),
        "cases": np.array([tuple(case.values()) for case in computed], dtype=[(name, object) for name in computed[0]]),
        "placement": f"on the {p.on}, about {p.about}, in the axes {p.axes}",
        "made_of": _names([f"{name} {text}".strip() for name, text in provenance.lines()]),
        "units": UNITS,
        "conventions": CONVENTIONS,
    }
    savemat(path, {"ksl": said}, do_compression=True, long_field_names=True, oned_as="column")


def _names(texts: Sequence[str]) -> np.ndarray:
    """A cell array of texts, a column."""
    return np.array([*texts, None], dtype=object)[:-1].reshape(-1, 1)


def _case(case: LoadCase, wanted: Sequence[int]) -> dict[str, Any]:
    blocks = list(case.blocks())
    joints = [case.joints[k] for k in wanted]
    numbers = {name: np.full((len(case.motion.time), len(joints)), np.nan) for name in ("position", "speed", "acceleration", "effort")}
    for block in blocks:
        for i, joint in enumerate(joints):
            if joint.one_coordinate:
                for name, x in zip(("position", "speed", "acceleration"), block.motions.of(joint), strict=True):
                    numbers[name][block.rows, i] = x
            if has_drive(case.model, joint):
                numbers["effort"][block.rows, i] = block.tau[:, joint.v_index]
    return {"name": case.name, "time": case.motion.time[:, None], "wrench": np.concatenate([block.total[:, wanted] for block in blocks]), **numbers}
