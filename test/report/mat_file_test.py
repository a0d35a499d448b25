"""wrenches.mat, read by scipy: the numbers of the table, for several load cases and chosen joints."""

import numpy as np
import pytest
from scipy.io import loadmat

import ksl
from ksl.output import OutputError
from ksl.report import mat_file


def test_arrays_are_those_of_the_table(tmp_path, examples):
    run = ksl.compute_loads(
        examples / "robots/ur5.urdf", cases=examples / "cases/ur5_cases.toml", joints=["elbow", "tool0_joint"], order="ang_lin", axes="world"
    )
    assert "wrenches.mat" in run.write(tmp_path, mat=True)
    said = loadmat(tmp_path / "wrenches.mat", simplify_cells=True)["ksl"]
    assert list(said["joints"]) == ["elbow", "tool0_joint"] and list(said["components"]) == ["tx", "ty", "tz", "fx", "fy", "fz"]
    assert said["robot"] == "ur5" and said["placement"] == "on the child, about the joint's origin, in the axes world"
    table = run.wrenches
    rows = {name: np.array(table[name].to_pylist(), dtype=object) for name in ("case", "joint")}
    assert [case["name"] for case in said["cases"]] == [case.name for case in run.cases]
    for case in said["cases"]:
        for k, joint in enumerate(said["joints"]):
            of = (rows["case"] == case["name"]) & (rows["joint"] == joint)
            wrench = np.column_stack([table[c].to_numpy()[of] for c in said["components"]])
            n = len(wrench)
            assert np.array_equal(case["wrench"].reshape(n, 2, 6)[:, k], wrench)
            for name in ("position", "speed", "acceleration"):
                assert np.array_equal(case[name].reshape(n, 2)[:, k], table[name].to_numpy(zero_copy_only=False)[of].astype(float), equal_nan=True), name


def test_of_matlab_the_shapes_and_too_many(tmp_path, examples, monkeypatch):
    run = ksl.compute_loads(examples / "robots/ur5.urdf", examples / "motions/ur5_pick.csv")
    run.write(tmp_path, mat=True)
    said = loadmat(tmp_path / "wrenches.mat")["ksl"][0, 0]
    assert (
        said["joints"].shape == (8, 1)
        and said["cases"].shape == (1, 1)
        and said["cases"][0, 0]["time"].shape == (1026, 1)
        and said["cases"][0, 0]["wrench"].shape == (1026, 8, 6)
    )
    monkeypatch.setattr(mat_file, "MOST_BYTES", 1000)
    with pytest.raises(OutputError, match="wrenches.mat: 1026 samples of 8 joints are more than such a file holds in one array; leave out --mat"):
        run.write(tmp_path, mat=True)
