"""Results as sizing takes them: wrenches moved back to the joint, tables that are refused, single poses, any order of rows."""

import json

import ksl
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from ksl.base.errors import SizingError
from ksl.sizing.results import Results, read_results
from ksl.sizing.samples import Spectrum
from results_tables import results_table


@pytest.fixture(scope="module")
def ur5(examples):
    return ksl.load(examples / "robots/ur5.urdf")


def sines(m, n=41):
    t = np.linspace(0, 2, n)
    w, p = np.arange(1, m.nv + 1) / 2, np.arange(m.nv)
    angle = t[:, None] * w + p
    return t, np.sin(angle), w * np.cos(angle), -(w**2) * np.sin(angle)


COMPONENTS = {
    "component": [
        {"joint": "elbow", "kind": "crossed roller bearing", "position": 0.05, "pitch_diameter": 0.1, "C": 1e4, "C0": 1e4},
        {"joint": "elbow", "kind": "limits", "at": [0.1, 0.2, 0.3], "axial_force": 10, "radial_force": 10, "bending_moment": 10, "torque": 10},
        {"joint": "base", "kind": "bolted flange", "bolts": 6, "circle_diameter": 0.2, "load_factor": 0.1, "preload": 4000},
    ]
}


def same(a, b):
    assert [(f.joint, f.figure) for f in a.in_order] == [(f.joint, f.figure) for f in b.in_order]
    np.testing.assert_allclose([f.value for f in a.in_order], [f.value for f in b.in_order], rtol=1e-9)


@pytest.mark.parametrize("how", [{"on": "parent"}, {"at": (0.1, -0.2, 0.05)}, {"on": "parent", "at": (0.0, 0.3, 0.0)}, {"order": "ang_lin"}], ids=str)
def test_other_sides_points_and_orders_are_undone(ur5, how):
    motion = {"sines": sines(ur5)}
    plain, other = (ksl.size(results_table(ur5, motion, **h), COMPONENTS) for h in ({}, how))
    same(plain, other)
    np.testing.assert_allclose(plain.peak_table["bending_moment"].to_pylist(), other.peak_table["bending_moment"].to_pylist(), rtol=1e-9)


@pytest.mark.parametrize(
    "how, words",
    [
        ({"axes": "world"}, "axes `world`.*without --axes"),
        ({"axes": "tool0"}, "axes `tool0`"),
        ({"at": "world"}, "point `world`.*without --at"),
        ({"at": "wrist_1_link"}, "`wrist_1_link`"),
    ],
)
def test_axes_and_points_that_move_against_the_joint_are_refused(ur5, how, words):
    if how.get("axes") == "tool0":
        how = {"axes": ur5.link_names[-1]}
        words = "axes `"
    with pytest.raises(SizingError, match=words):
        ksl.size(results_table(ur5, {"sines": sines(ur5)}, **how))


def test_rows_in_any_order_of_joints(ur5):
    """By joint instead of by sample, and some joints left out."""
    table = results_table(ur5, {"a": sines(ur5), "b": sines(ur5, 31)})
    order = np.argsort(np.array(table["joint"].to_pylist(), dtype=object).astype(str), kind="stable")
    same(ksl.size(table, COMPONENTS), ksl.size(table.take(order), COMPONENTS))
    kept = table.filter(pa.array([j in ("elbow", "base") for j in table["joint"].to_pylist()]))
    part = Results(kept)
    np.testing.assert_array_equal(part.joint("base").force, Results(table).joint("base").force)
    with pytest.raises(SizingError, match="has no rows of wrist_1"):
        part.joint("wrist_1")


def test_weights_are_the_time_each_sample_stands_for(ur5):
    table = Results(results_table(ur5, {"a": sines(ur5), "b": sines(ur5, 31)}))
    s = table.joint("elbow", Spectrum({"b": 3}))
    assert s.weight.sum() == pytest.approx(2 + 3 * 2) and s.weight[0] == pytest.approx(0.025) and s.weight[1] == pytest.approx(0.05)
    assert [(case, part.stop - part.start) for case, part in s.slices()] == [("a", 41), ("b", 31)]


def test_a_single_pose_counts_for_peaks(ur5):
    table = results_table(ur5, {"motion": sines(ur5)})
    still = (np.array([0.0, 1.0]), *(np.zeros((2, 6)) for _ in range(3)))
    pose = results_table(ur5, {"pose": still}).slice(0, len(ur5.joints))
    both = pa.concat_tables([table, pose], promote_options="permissive").replace_schema_metadata(table.schema.metadata)
    s = Results(both).joint("elbow")
    assert s.weight[-1] == 0 and s.cases == ("motion", "pose")
    assert "elbow" in {row["joint"] for row in ksl.size(both).peaks}


def written(tmp_path, table):
    pq.write_table(table, tmp_path / "wrenches.parquet")
    return tmp_path


def test_a_folder_its_file_and_the_table_are_the_same(ur5, tmp_path):
    table = results_table(ur5, {"sines": sines(ur5)})
    folder = written(tmp_path, table)
    for given in (folder, str(folder / "wrenches.parquet"), type("Run", (), {"wrenches": table})()):
        same(ksl.size(table, COMPONENTS), ksl.size(given, COMPONENTS))


def test_what_are_no_results(ur5, tmp_path):
    table = results_table(ur5, {"sines": sines(ur5)})
    said = json.loads(table.schema.metadata[b"ksl"])
    del said["joints"]
    for bad, words in (
        (table.drop_columns(["fx"]), "lacks the column fx"),
        (table.replace_schema_metadata({}), "lacks the metadata `ksl`"),
        (table.replace_schema_metadata({"ksl": json.dumps(said)}), "earlier version.*run `ksl loads` again"),
        (table.slice(0, 0), "holds no samples"),
    ):
        with pytest.raises(SizingError, match=words):
            Results(bad)
    with pytest.raises(SizingError, match="no such file; give the folder"):
        read_results(tmp_path / "none")
    with pytest.raises(SizingError, match="this folder has no wrenches.parquet"):
        read_results(tmp_path)
    (tmp_path / "wrenches.parquet").write_text("time,joint\n")
    with pytest.raises(SizingError, match="is no Parquet file that can be read"):
        read_results(tmp_path)
    whole = written(tmp_path, table) / "wrenches.parquet"
    whole.write_bytes(whole.read_bytes()[:-100])
    with pytest.raises(SizingError, match="is no Parquet file that can be read"):
        read_results(tmp_path)
    with pytest.raises(SizingError, match="int is no table of wrenches"):
        ksl.size(3)


def with_column(table, name, values):
    return table.set_column(table.column_names.index(name), name, pa.array(values))


def with_number(table, name, number):
    values = table[name].to_pylist()
    values[3] = number
    return with_column(table, name, values)


def with_metadata(table, **entries):
    said = json.loads(table.schema.metadata[b"ksl"]) | entries
    return table.replace_schema_metadata({"ksl": json.dumps(said)})


ALTERED = {
    "no joints": (lambda t: with_metadata(t, joints=[]), "`joints` in its metadata is no list of joints with name, kind and axis"),
    "joints": (lambda t: with_metadata(t, joints=3), "`joints` in its metadata is no list of joints with name, kind and axis"),
    "a joint": (lambda t: with_metadata(t, joints=[{"name": "elbow"}]), "`joints` in its metadata is no list of joints with name, kind and axis"),
    "metadata": (lambda t: t.replace_schema_metadata({"ksl": "[]"}), "its metadata `ksl` is no JSON object"),
    "no JSON": (lambda t: t.replace_schema_metadata({"ksl": "{"}), "its metadata `ksl` is no JSON object"),
    "point": (lambda t: with_metadata(t.drop_columns(["at"]), at="joint + 1 x"), "moments are about the point 'joint + 1 x', which is none"),
    "text": (lambda t: with_column(t, "fx", ["a"] * len(t)), "the column fx holds string; expected numbers: run"),
    "time as text": (lambda t: with_column(t, "time", ["a"] * len(t)), "the column time holds string; expected numbers: run"),
    "no effort": (lambda t: t.drop_columns(["effort"]), "lacks the column effort"),
    "no speed": (lambda t: t.drop_columns(["speed"]), "lacks the column speed"),
    "infinite": (lambda t: with_number(t, "fx", np.inf), "the column fx is infinite in row 4"),
    "missing": (lambda t: with_number(t, "tz", None), "the column tz is missing or not a number in row 4"),
    "NaN time": (lambda t: with_number(t, "time", np.nan), "the column time is missing or not a number in row 4"),
    "infinite effort": (lambda t: with_number(t, "effort", -np.inf), "the column effort is infinite in row 4"),
    "no name": (lambda t: with_number(t, "joint", None), "the column joint lacks a name in some rows"),
    "numbers as names": (lambda t: with_column(t, "joint", [3] * len(t)), "the column joint holds int64; expected names: run"),
}


@pytest.mark.parametrize("altered", ALTERED)
def test_results_that_somebody_has_altered(ur5, tmp_path, altered):
    change, words = ALTERED[altered]
    bad = change(results_table(ur5, {"sines": sines(ur5)}))
    for given, name in ((bad, "results"), (written(tmp_path, bad), str(tmp_path))):
        with pytest.raises(SizingError) as caught:
            ksl.size(given, COMPONENTS)
        assert str(caught.value).startswith(f"{name}: {words}")
        assert str(caught.value).endswith("run `ksl loads` again")


def test_names_that_there_are_not(ur5):
    table = results_table(ur5, {"sines": sines(ur5)})
    with pytest.raises(SizingError, match="joints: no joint named 'elbov'; did you mean 'elbow'"):
        ksl.size(table, joints=["elbov"])
    with pytest.raises(SizingError, match="at: no joint named 'elbov'"):
        ksl.size(table, at={"elbov": (0, 0, 0)})
    with pytest.raises(SizingError, match="at: the point of elbow must be three finite numbers"):
        ksl.size(table, at={"elbow": (0, 0)})


def test_the_simultaneous_sets(ur5):
    """Each row is one sample; its extreme is that of the whole; a point along the axis changes bending alone."""
    motion = sines(ur5)
    table = results_table(ur5, {"sines": motion})
    sizing = ksl.size(table, joints=["elbow", "base"], at={"elbow": (0.0, 0.3, 0.0)})
    rows = [row for row in sizing.peaks if row["joint"] == "elbow"]
    joint = ur5.joint("elbow")
    w = ur5.reactions(*motion[1:], joints=["elbow"], at=(0.0, 0.3, 0.0))[:, 0]
    axis = np.array(joint.axis)
    curves = {
        "axial_force": w[:, :3] @ axis,
        "axial_moment": w[:, 3:] @ axis,
        "bending_moment": np.linalg.norm(np.cross(w[:, 3:], axis), axis=1),
        "speed": motion[2][:, joint.v_index],
    }
    for row in rows:
        k = int(np.searchsorted(motion[0], row["time"]))
        quantity, which = row["extreme"].rsplit(" ", 1)
        for name, x in curves.items():
            assert row[name] == pytest.approx(x[k], rel=1e-9, abs=1e-9)
        if quantity in curves:
            x = curves[quantity]
            assert row[quantity] == pytest.approx(x.max() if which == "max" else x.min())
    assert {row["extreme"] for row in rows} >= {"axial_force max", "axial_force min", "axial_moment min", "speed min", "bending_moment max"}
    assert {row["extreme"] for row in sizing.peaks if row["joint"] == "base"} == {
        "axial_force max",
        "axial_force min",
        "radial_force max",
        "bending_moment max",
        "axial_moment max",
        "axial_moment min",
    }
    assert sizing.peak_table.schema.field("bending_moment").metadata == {b"unit": b"N m"}
