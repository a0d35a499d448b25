"""Results as sizing takes them: wrenches moved back to the joint, tables that are refused, single poses, any order of rows."""

import json

import ksl
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from ksl.base.errors import SizingError
from ksl.base.rounding import OF_POSITIONS
from ksl.sizing.results import WRENCH, Results, read_results
from ksl.sizing.samples import Spectrum, moved
from results_tables import AXIS, made_table, results_table
from text_that_is_none import damaged_text


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


def test_points_of_single_joints_are_undone(ur5):
    """As `ksl loads --at elbow=…` writes them; what moves against a joint is refused where that joint is asked for alone."""
    motion = {"sines": sines(ur5)}
    plain, moved, world = (results_table(ur5, motion, at=at) for at in ("joint", (0.1, -0.2, 0.05), "world"))

    def of_elbow(table):
        is_elbow = np.array(table["joint"].to_pylist()) == "elbow"
        rows = pa.concat_tables([plain.filter(~is_elbow), table.filter(is_elbow)], promote_options="permissive")
        return rows.replace_schema_metadata(plain.schema.metadata)

    same(ksl.size(plain, COMPONENTS), ksl.size(of_elbow(moved), COMPONENTS))
    assert ksl.size(of_elbow(world), joints=["wrist_1"]).peaks == ksl.size(plain, joints=["wrist_1"]).peaks
    with pytest.raises(SizingError, match="point `world`, which moves against the joints"):
        ksl.size(of_elbow(world), joints=["elbow"])


def test_components_of_joints_that_are_not_there_are_left_out(ur5):
    table = results_table(ur5, {"sines": sines(ur5)})
    only = table.filter(np.array(table["joint"].to_pylist()) == "wrist_1")
    parts = {"component": [{"joint": j, "kind": "limits", "torque": 1e3} for j in ("elbow", "wrist_1")]}
    found, nothing = ksl.size(only, parts), ksl.size(only, {"component": parts["component"][:1]})
    assert [(x.joint, x.figure) for x in found.left_out] == [("elbow", "every figure")] and "1 left out" in found.verdict
    assert nothing.verdict == "ur5: nothing was compared with a limit" and not ksl.size(only, parts, joints=["wrist_1"]).left_out


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
    names = damaged_text(table.column("joint").to_pylist())
    written(tmp_path, table.set_column(table.schema.get_field_index("joint"), "joint", names))
    with pytest.raises(SizingError, match=r"is no Parquet file that can be read \(column 'joint' holds text that is no UTF-8\)"):
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
    "a stranger": (
        lambda t: with_column(t, "joint", ["x" if j == "base" else j for j in t["joint"].to_pylist()]),
        "the table has a joint x that its metadata does not know",
    ),
    "equal times": (lambda t: with_column(t, "time", [min(x, 1.9) for x in t["time"].to_pylist()]), "times of case sines don't increase"),
    "no position": (lambda t: with_number(t, "position", np.nan), "wrist_1 has samples without position, speed or acceleration"),
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
    with pytest.raises(SizingError, match="at: the point of elbow needs three finite numbers"):
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
    of_base = {"axial_force max", "axial_force min", "radial_force max", "bending_moment max", "axial_moment max", "axial_moment min"}
    assert {row["extreme"] for row in sizing.peaks if row["joint"] == "base"} == of_base
    assert sizing.peak_table.schema.field("bending_moment").metadata == {b"unit": b"N m"}


@pytest.mark.parametrize("on", [["child", "parent"], ["child", "parent", "x", "y"]])
def test_a_table_on_both_sides_is_refused(on):
    table = made_table({"a": {"time": np.arange(4.0)}}).append_column("on", pa.array((2 * on)[:4]))
    with pytest.raises(SizingError, match=f"the column on has several values, {', '.join(map(repr, on[:3]))}; expected one$"):
        Results(table)


def test_rows_of_one_joint_without_cases_are_a_motion_and_those_of_several_are_in_order():
    with pytest.raises(SizingError, match="rows of different cases are mixed; sort them by case and time"):
        Results(with_column(made_table({"a": {"time": np.arange(4.0)}}), "case", ["a", "b", "b", "a"]))
    table = made_table({"a": {"time": [0.0, 1.0], "fx": [1.0, 2.0]}}).drop_columns(["case"])
    s = Results(table).joint("j")
    assert s.cases == ("motion",) and s.force[:, 0].tolist() == [1, 2]


@pytest.mark.parametrize("kind", ["revolute", "prismatic", "fixed"])
def test_speeds_of_rounding_are_zero_beside_the_shorter_step(kind):
    """Some hundred units in the last place of the largest position, over the step to the nearer neighbour in the same case."""
    times = {"a": np.array([5.0, 5.5, 5.6]), "b": np.array([0.0, 2.0]), "pose": np.array([7.0])}
    step = np.array([0.5, 0.1, 0.1, 2, 2, np.inf])
    still = OF_POSITIONS * 4.0 / step
    for share, stands in ((0.99, True), (1.01, False)):
        speeds = np.split(share * still * [1, -1, 1, -1, 1, 1], [3, 5])
        table = made_table({case: {"time": t, "position": -4.0, "speed": v} for (case, t), v in zip(times.items(), speeds, strict=True)}, kind)
        s = Results(table).joint("j")
        assert (s.speed[:5] == 0).tolist() == [stands and kind != "fixed"] * 5
        assert s.resolution == (pytest.approx(np.median(still)) if kind != "fixed" else 0)
        said = made_table(
            {case: {"time": t} for case, t in times.items()},
            kind,
            cases=[{"resolution": {"j": 0.2}}, {}, {"resolution": {"j": 0.3, "k": 9.0}}, {"resolution": {"j": np.inf}}],
        )
        assert Results(said).joint("j").resolution == (0.3 if kind != "fixed" else 0)
    for broken in (3, [3], [{"resolution": {"j": "x"}}], [{"resolution": 3}]):
        assert Results(made_table({"a": {"time": [0.0, 1.0]}}, kind, cases=broken)).joint("j").resolution == 0
    assert Results(made_table({"pose": {"time": [3.0], "speed": 1e-20, "position": 1.0}}, kind)).joint("j").speed[0] == 1e-20, "of one sample nothing is known"


def test_an_axis_that_is_none_is_z():
    for kind, axis, found in (
        ("revolute", [0.6, 0, 0.8], (0.6, 0, 0.8)),
        ("revolute", [0, 0.51, 0], (0, 0.51, 0)),
        ("revolute", [0, 0.49, 0], (0, 0, 1)),
        ("revolute", [0, 0, 0], (0, 0, 1)),
        ("revolute", None, (0, 0, 1)),
        ("fixed", [1, 0, 0], (0, 0, 1)),
    ):
        joint = Results(made_table({"a": {"time": [0.0, 1.0]}}, joints=[{"name": "j", "kind": kind, "axis": axis}])).joints["j"]
        assert joint.axis == found and joint.has_axis == (found != (0, 0, 1)) and joint.turns == (kind == "revolute")


@pytest.mark.parametrize("said", [None, "far", True, float("nan"), float("inf"), [1.0]])
def test_an_extent_that_is_none(said):
    table = made_table({"a": {"time": [0.0, 1.0]}}, extent=said)
    assert Results(table).extent == (1.0 if said is True else 0.0) and Results(made_table({"a": {"time": [0.0, 1.0]}}, extent=1.5)).extent == 1.5


def test_rotors_as_bodies_are_said():
    for physics, said in (("rotor bodies, damping", 1), ("damping", 0)):
        assert len(ksl.size(made_table({"a": {"time": [0.0, 1.0]}}, physics=physics)).notes) == said


# what rigid bodies leave open


@pytest.mark.parametrize("at", [None, (0, 0, 0), (0.3, 0, 0), (0, -0.2, 0), (0, 0, 0.1), (0.3, -0.2, 0.1)])
@pytest.mark.parametrize("axis", [(0, 0, 1), (-1, 0, 0), (0.6, 0, 0.8), (0.6, 0.64, 0.48)])
def test_figures_that_an_open_component_changes_are_not_judged(at, axis):
    """And no others: each component of the wrench about the joint's origin is changed in turn."""
    rng, joints = np.random.default_rng(4), [{"name": "j", "kind": "revolute", "axis": axis}]
    wrench, limits = (
        dict(zip(WRENCH, rng.normal(size=(6, 3)), strict=True)),
        dict.fromkeys(("axial_force", "radial_force", "bending_moment", "torque", "speed_rpm"), 1e3),
    )
    parts = {"component": [{"joint": "j", "kind": "limits", **limits, **({} if at is None else {"at": list(at)})}]}
    size = lambda wrench: made_table({"a": {"time": np.arange(3.0), "speed": 1.0, **wrench}}, joints=joints)
    before = ksl.size(size(wrench), parts).in_order
    for name in WRENCH:
        after = ksl.size(size(wrench | {name: wrench[name] + [0.5, 0.7, 0.9]}), parts).in_order
        table = size(wrench).append_column("undetermined", pa.array([name, "", ""]))
        sizing = ksl.size(table, parts)
        changed = {f.figure for f, g in zip(before, after, strict=True) if abs(f.value - g.value) > 1e-9}
        assert {f.figure for f in sizing.in_order if not f.verdict} == changed, name
        assert {x.figure for x in sizing.left_out} == {f"the verdict on “{figure}”" for figure in changed}
        assert all(("needs stiffnesses of joints" in f.note) == (f.figure in changed) for f in sizing.in_order)


BEARING, SIDE = {"C": 9e4, "C0": 8e4}, {"type": "deep groove", "f0": 13.0}
CARRIERS = [
    {"kind": "crossed roller bearing", "position": 0.2, "pitch_diameter": 0.1, **BEARING},
    {"kind": "bearing pair", "locating": BEARING | SIDE | {"position": -0.1}, "floating": BEARING | SIDE | {"position": 0.2}},
    {"kind": "opposed angular contact bearings", "arrangement": "back-to-back", "a": BEARING | {"position": -0.1}, "b": BEARING | {"position": 0.2}},
    {"kind": "bolted flange", "bolts": 5, "circle_diameter": 0.2, "load_factor": 0.1, "preload": 4e3, "friction": 0.2, "yield_force": 9e3, "amplitude_limit": 9.0},
    {"kind": "fatigue", "stress": {"fx": 1.0, "tz": 2.0}, "at": [0, 0.1, 0], "k": 5, "knee_amplitude": 9.0, "knee_cycles": 1e6, "required_repetitions": 1.0},
]  # fmt: skip


@pytest.mark.parametrize("part", CARRIERS, ids=lambda part: part["kind"])
def test_what_is_open_of_bearings_and_flanges(part):
    """No figure that an open component changes is judged; and all are that use none: a bearing carries no moment about its axis."""
    wrench, joints = dict(zip(WRENCH, np.random.default_rng(4).normal(size=(6, 3)), strict=True)), [{"name": "j", "kind": "revolute", "axis": [0, 0, 1]}]
    parts = {"component": [{"joint": "j", **part}], "required_life_h": 100.0}
    table = lambda wrench: made_table({"a": {"time": np.arange(3.0), "speed": 9.0, "position": [0, 9, 18.0], **wrench}}, joints=joints)
    before = ksl.size(table(wrench), parts).in_order
    for name in WRENCH:
        after = {f.figure: f.value for f in ksl.size(table(wrench | {name: wrench[name] + [5, 7, 9.0]}), parts).in_order}
        found = {f.figure: f.verdict for f in ksl.size(table(wrench).append_column("undetermined", pa.array([name, "", ""])), parts).in_order}
        changed = {f.figure for f in before if f.verdict and abs(f.value - after[f.figure]) > 1e-9 * abs(f.value)}
        assert all(found[figure] == "" for figure in changed) and (changed or name == "tz" or part["kind"] == "fatigue"), name
        if not changed and name == ("tz" if "bearing" in part["kind"] else "fy"):
            assert {f.figure for f in before if f.verdict} == {figure for figure, verdict in found.items() if verdict}


def test_moments_get_a_share_of_open_forces():
    """Where move × force has one: of every force and every move."""
    for move in np.array(np.meshgrid(*[[0, 0.5]] * 3)).reshape(3, -1).T:
        for k, name in enumerate(WRENCH):
            shares = np.cross(move, np.eye(3)[k]) if k < 3 else np.zeros(3)
            assert moved((name,), move) == tuple(n for n, x in zip(WRENCH, [*np.zeros(3), *shares], strict=True) if x or n == name)


# the object


@pytest.mark.parametrize("count", [0, 1, 12, 13, 15])
def test_a_sizing_in_a_few_lines(count):
    """The first twelve figures, and how many more there are; what is over its limit is counted."""
    table = made_table({"a": {"time": [0.0, 1.0], "tz": 1.0}})
    parts = [{"joint": "j", "kind": "limits", "name": f"part {k}", "torque": 2.0 if k else 0.5} for k in range(count)]
    sizing = ksl.size(table, {"component": parts} if parts else None)
    first, *lines = repr(sizing).splitlines()
    assert len(lines) == min(count, 12) + (count > 12) and (count <= 12 or lines[-1] == f"  … and {count - 12} more in .figures and .table")
    over = f"1 of {count} figures is over its limit; worst: j, part 0, torque, utilisation 1.6"
    assert first == "Sizing of r: " + (over if count else "no components") == f"Sizing of {sizing.verdict}"
    both = ksl.size(table, {"component": [part | {"torque": 0.5} for part in parts[:2]]}) if count > 1 else None
    assert both is None or both.verdict.startswith("r: 2 of 2 figures are over their limit")
    open_ended = {"joint": "j", "kind": "fatigue", "stress": {"tz": 1.0}}
    assert ksl.size(table, {"component": [open_ended]}).verdict == "r: nothing was compared with a limit"
    assert (
        ksl.size(table, {"component": [*parts[1:], open_ended]}).verdict.startswith(
            f"r: all {count - 1} figures with a limit are within it; 1 left out; worst: j, "
        )
        or count < 2
    )
    assert [f.verdict for f in sizing.figures] == ["over", *["within"] * (count - 1)][:count] and len(sizing.exceeded) == bool(count)


@pytest.mark.parametrize(("torque", "verdict"), [(0.9, "near"), (0.8999, "within"), (1.0, "near"), (1.0001, "over")])
def test_colours_of_figures(torque, verdict):
    table = made_table({"a": {"time": [0.0, 1.0], "tx": torque * AXIS[0], "tz": torque * AXIS[2]}})
    (figure,) = ksl.size(table, {"component": [{"joint": "j", "kind": "limits", "torque": 1.0}]}).figures
    assert figure.verdict == verdict
