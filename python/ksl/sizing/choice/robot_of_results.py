"""The load cases of results, with the robot that they are of: those of a run, or read again from the file that the results name."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ksl.base.errors import DescriptionError, MotionError, SizingError
from ksl.base.files_read import recorded
from ksl.load_cases.load_case import LoadCase, Placement
from ksl.load_cases.undetermined import Undetermined
from ksl.load_cases.wrench_table import motion_of_arrays
from ksl.mechanism.mechanism import Joint
from ksl.model.model import Model
from ksl.robot_files.loading import load
from ksl.sizing.results import Results

WHY = "the masses of what is chosen go back into the robot where [[choose]] names a link"
MEND = "give ksl.size what ksl.compute_loads returns, or leave out `link` in [[choose]]"
READING = {"floating_base": "floating_base", "mimic": "mimic", "model": "model", "loops": "loops", "drives": "drives"}
"""{option of `ksl loads`: argument of `ksl.load`}."""


def cases_of(results: Any, table: Results) -> list[LoadCase]:
    """The load cases, with wrenches on the child about the joints' origins; what rigid bodies leave open of them is not looked for again.  results: as `ksl.size` was given them.

    Raises SizingError where they can't be made again: of sweeps, of results that miss joints, and where the robot's file has changed.
    """
    given = getattr(results, "cases", ())
    if isinstance(given, tuple) and given and all(isinstance(case, LoadCase) for case in given):
        return [
            LoadCase(case.model, case.motion, name=case.name, brakes_from=case.brakes_from, static=case.static, known_undetermined=Undetermined())
            for case in given
        ]
    if table.of_sweep:
        raise SizingError(f"{table.file}: {WHY}, and results of a sweep don't say how each case is mounted; leave out `link`, or write load cases")
    model = _robot(table)
    said = {str(case.get("name")): case for case in table.metadata.get("cases", []) if isinstance(case, Mapping)}
    return [_case(table, model, name, said.get(name, {})) for name in table.cases]


def _robot(table: Results) -> Model:
    """The robot's file, read as `ksl loads` has read it."""
    inputs = [x for x in table.metadata.get("inputs", []) if isinstance(x, Mapping) and x.get("role") == "robot"]
    if not inputs:
        raise SizingError(f"{table.file}: {WHY}, and these results name no robot file; {MEND}")
    folder, options = str(table.metadata.get("directory", "")), table.metadata.get("options", {})
    file = Path(folder) / str(inputs[0].get("file"))
    how = {argument: options[option] for option, argument in READING.items() if options.get(option)}
    if isinstance(how.get("drives"), str):
        how["drives"] = [name.strip() for name in how["drives"].split(",")]
    if how.get("loops") not in (None, "cut"):
        how["loops"] = str(Path(folder) / str(how["loops"]))
    try:
        with recorded() as ledger, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # `ksl loads` has said them
            model = load(file, **how)
    except (DescriptionError, ValueError, TypeError) as e:
        raise SizingError(f"{table.file}: {WHY}, and the robot can't be read again: {e}; {MEND}") from None
    if [read.sha256 for read in ledger.files if read.role == "robot"][:1] != [inputs[0].get("sha256")]:
        raise SizingError(f"{table.file}: {WHY}, and {file} has changed since these results were made; run `ksl loads` again")
    found = {j.name: j.kind for j in model.joints}
    if any(found.get(j.name, j.kind) != j.kind for j in table.joints.values()) or not set(found) <= set(table.joints):
        raise SizingError(f"{table.file}: {WHY}, and {file} has other joints than these results; {MEND}")
    return model


def _case(table: Results, model: Model, name: str, said: Mapping[str, Any]) -> LoadCase:
    """A load case with the positions and rates that the results hold."""
    moving = [j for j in model.joints if j.nv > 0]
    whole = [j for j in moving if not j.one_coordinate]
    if whole:
        raise SizingError(f"{table.file}: {WHY}, and results don't hold the motion of {whole[0].name}, which is {whole[0].kind}; {MEND}")
    missing = [j.name for j in moving if not table.holds(j.name)]
    if missing:
        raise SizingError(f"{table.file}: {WHY}, and these results lack joints: {', '.join(missing)}; run `ksl loads` without --joints")
    time = np.zeros(0)
    q, v, a = (np.zeros((0, width)) for width in (model.nq, model.nv, model.nv))
    for j in moving:
        s = table.joint(j.name)
        rows = s.case_index == table.cases.index(name)
        if not len(time):
            time = s.time[rows]
            q, v, a = (np.zeros((len(time), width)) for width in (model.nq, model.nv, model.nv))
        _put(j, (q, v, a), [x[rows] for x in (s.position, s.speed, s.acceleration)])
    if not moving:
        raise SizingError(f"{table.file}: no joint of the robot moves")
    try:
        gravity = said.get("gravity")
        under = model if gravity is None else model.with_gravity(gravity)
        return LoadCase(under, motion_of_arrays(under, time, q, v, a), Placement(), name=name, known_undetermined=Undetermined())
    except (MotionError, ValueError, TypeError) as e:
        raise SizingError(f"{table.file}: {WHY}, and the load case {name} can't be made again: {e}; {MEND}") from None


def _put(joint: Joint, into: Sequence[np.ndarray], values: Sequence[np.ndarray]) -> None:
    """Values of a joint into its columns of q, v and a."""
    for x, column, value in zip(into, (joint.q_index, joint.v_index, joint.v_index), values, strict=True):
        x[:, column] = value
