"""Load spectra against sums by hand, exact integrals, the example of ASTM E1049 and sums over the samples."""

import csv
import json
import math

import ksl
import numpy as np
import pyarrow as pa
import pytest
from ksl.base.errors import SizingError
from ksl.sizing.spectra import bearing_classes
from ksl.sizing.spectra.bearing_classes import BearingLoads, bearing_axes
from ksl.sizing.spectra.classes import round_edges
from results_tables import AXIS, made_table

RPM = 60 / (2 * math.pi)
COLUMNS = ["share", "Fx", "Fy", "Fz", "My", "Mz", "speed_rpm"]


def turning(seed=3, n=4001):
    """A joint that turns both ways and pauses, with loads that drift and jump."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 40, n)
    loads = {c: 100 * rng.normal() + np.cumsum(rng.normal(size=n)) + 40 * np.sin(rng.uniform(0.2, 2) * t) for c in ("fx", "fy", "fz", "tx", "ty", "tz")}
    speed = np.where(np.abs(np.sin(0.3 * t)) < 0.2, 0.0, 5 * np.sin(0.3 * t))
    return t, loads, speed


def results(**more):
    t, loads, speed = turning()
    position = np.cumsum(speed) * (t[1] - t[0])
    return made_table({"one": {"time": t, "speed": speed, "position": position, "effort": loads["tz"], **loads}}, **more)


def test_classes_by_hand():
    """Samples a second apart, of which the first and the last stand for half a second; the second case occurs three times."""
    one = {"time": [0, 1, 2, 3], "effort": [-3, 1, 5, 5], "speed": [2, 2, -2, 0], "position": [0, 2, 0, 0]}
    two = {"time": [0, 1], "effort": [1, 1], "speed": [1, 1], "position": [0, 1]}
    table = made_table({"one": one, "two": two})
    asked = {"torque_edges": [-4, 0, 4, 5], "speed_edges": [-3, -1, 1, 3]}
    s = ksl.spectra(table, "j", **asked, components={"component": [{"kind": "limits", "joint": "j"}], "cases": {"two": 3}})
    assert s.duration.tolist() == [[0, 0, 0.5], [0, 0, 4], [1, 0.5, 0]]
    assert np.allclose(2 * math.pi * s.revolutions, [[0, 0, 1], [0, 0, 5], [2, 0, 0]], rtol=1e-15)
    assert s.equivalent(3) == pytest.approx(((27 * 1 + 1 * 5 + 125 * 2) / 8) ** (1 / 3), rel=1e-15) and s.outside == 0 and s.oscillates
    assert all(ksl.spectra(table, ["j"], components={"component": [{"kind": "limits", "joint": "j"}], "cases": {"two": 3}}).notes)
    hour = ksl.spectra(table, "j", **asked, components={"component": [{"kind": "limits", "joint": "j"}], "shares": {"one": 1, "two": 3}})
    assert hour.duration.sum() == pytest.approx(3600) and hour.duration[1, 2] == pytest.approx(900 / 3 + 2700)
    assert ksl.spectra(table, "j", torque_edges=[0, 4], speed_edges=[-3, 3]).notes[-1] == "2 s are outside of the classes of torque and speed"


def test_exact_integrals():
    """A torque that rises evenly at an even speed, and one that rises with the speed."""
    t = np.linspace(0, 3, 3001)
    for p in (3.0, 10 / 3):
        even = ksl.spectra(made_table({"c": {"time": t, "effort": 4 * t, "speed": 2.0, "position": 2 * t}}), "j")
        assert even.equivalent(p) == pytest.approx(12 * (1 / (p + 1)) ** (1 / p), rel=1e-6)
        rising = ksl.spectra(made_table({"c": {"time": t, "effort": 4 * t, "speed": 2 * t, "position": t**2}}), "j")
        assert rising.equivalent(p) == pytest.approx(12 * (2 / (p + 2)) ** (1 / p), rel=1e-6)
    assert rising.revolutions.sum() == pytest.approx(9 / (2 * math.pi), rel=1e-12) and rising.duration.sum() == pytest.approx(3)
    assert not rising.oscillates and even.oscillates is (6 < 2 * math.pi)
    assert [any("oscillates" in note for note in s.notes) for s in (rising, even)] == [False, even.oscillates]


def test_round_edges():
    for x, signed, edges in (
        ([0.0, 41.3], True, np.arange(-1, 44, 2)), ([-3.0, 9.7], True, np.arange(-3.5, 11)), ([0.0, 90.0], False, np.arange(0, 96, 5)), ([], True, [-0.005, 0.005]),
        ([0.0, 23.0], True, np.arange(-0.5, 24)),
    ):  # fmt: skip
        assert round_edges(np.array(x), signed).tolist() == list(edges), x
    of_any_size = np.random.default_rng(1).normal(size=(300, 2)) * 10.0 ** np.random.default_rng(2).uniform(-3, 3, (300, 1))
    for x in ([0.0, 0.0], [-3.0, 9.7], [1e-5, 2e-5], [4.0, 4.0], [-7e6, 1.0], [0.0, 41.3], [0.0, 90.0], *np.sort(of_any_size)):
        edges = round_edges(np.array(x))
        widths = np.diff(edges)
        assert edges[0] <= min(x) and max(x) < edges[-1] and np.allclose(widths, widths[0])
        assert 12 <= len(widths) <= 24 or x[0] == x[1], "a width is twice the one before at most"
        assert np.isclose((edges / widths[0]) % 1, 0.5).all(), "a class lies about zero"
        assert any(np.isclose(widths[0], k * 10.0 ** round(math.log10(widths[0] / k))) for k in (1, 2, 2.5, 5)), widths[0]


@pytest.mark.parametrize("axis", [(0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, -1), AXIS])
def test_axes_of_the_bearing(axis):
    R = bearing_axes(np.array(axis, dtype=float))
    assert np.allclose(R @ R.T, np.eye(3)) and np.linalg.det(R) == pytest.approx(1) and np.allclose(R[0], axis)
    if sorted(axis) == [0, 0, 1]:
        k = axis.index(1)
        assert (R == np.eye(3)[[k, (k + 1) % 3, (k + 2) % 3]]).all(), "in cyclic order"


@pytest.mark.parametrize("classes", [6, 12, 40])
def test_a_bearing_in_classes_keeps_its_equivalent_loads(classes):
    table = results()
    s, (t, loads, speed) = ksl.spectra(table, "j"), turning()
    R, w = bearing_axes(np.array(AXIS)), np.abs(speed) * np.gradient(t)
    F, M = (np.column_stack([loads[f"{c}{x}"] for x in "xyz"]) @ R.T for c in "ft")
    b = s.bearing(classes)
    assert list(b) == COLUMNS and len(b["share"]) <= classes and b["share"].sum() == pytest.approx(1)
    turned = b["share"] * np.abs(b["speed_rpm"])
    assert turned.sum() / 60 * 40 == pytest.approx(s.revolutions.sum(), rel=1e-9) and (np.diff(b["share"]) <= 0).all()
    of_samples = (np.hypot(*F[:, 1:].T), np.abs(F[:, 0]), np.hypot(*M[:, 1:].T))
    of_classes = (np.hypot(b["Fy"], b["Fz"]), np.abs(b["Fx"]), np.hypot(b["My"], b["Mz"]))
    w[[0, -1]] /= 2
    for p in (3.0, 10 / 3):
        exact = [(np.sum(x**p * w) / w.sum()) ** (1 / p) for x in of_samples]
        assert np.allclose(s.bearing_equivalent(p), exact, rtol=1e-12)
        assert np.allclose([(np.sum(x**p * turned) / turned.sum()) ** (1 / p) for x in of_classes], exact, rtol=0.01 if classes < 12 else 1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_noise_with_heavy_tails_in_20_classes(seed):
    rng = np.random.default_rng(seed)
    loads = {c: rng.standard_t(3, size=3000) * 10 for c in ("fx", "fy", "fz", "tx", "ty", "tz")}
    s = ksl.spectra(made_table({"c": {"time": np.arange(3000.0), "speed": rng.normal(size=3000), "position": np.arange(3000.0), **loads}}), "j")
    b = s.bearing(20)
    turned = b["share"] * np.abs(b["speed_rpm"])
    for p in (3.0, 10 / 3):
        few = [(np.sum(x**p * turned) / turned.sum()) ** (1 / p) for x in (np.hypot(b["Fy"], b["Fz"]), np.abs(b["Fx"]), np.hypot(b["My"], b["Mz"]))]
        assert np.allclose(few, s.bearing_equivalent(p), rtol=1e-9)


def test_classes_do_not_depend_on_units():
    """Samples are grouped by shares of each load: forces in mN, moments and speeds in units of their own give the same groups."""
    rng = np.random.default_rng(3)
    axial, radial, tilting, speed, weight = (
        rng.standard_t(3, 900),
        rng.standard_t(3, (900, 2)),
        rng.standard_t(3, (900, 2)),
        rng.normal(size=900),
        rng.uniform(1, 2, 900),
    )
    plain = bearing_classes.bearing_classes(BearingLoads(axial, radial, tilting, speed, weight), 20)
    scaled = bearing_classes.bearing_classes(BearingLoads(1e4 * axial, 1e-3 * radial, 1e3 * tilting, 1e2 * speed, weight), 20)
    for (name, x), factor in zip(plain.items(), (1, 1e4, 1e-3, 1e-3, 1e3, 1e3, 1e2), strict=True):
        np.testing.assert_allclose(scaled[name], factor * x, rtol=1e-9, err_msg=name)


def test_too_few_classes_say_how_many_are_needed(monkeypatch):
    """20 N for a while, and 1 N for the rest of the time: one class can't have the mean of both exponents."""
    t = np.arange(101.0)
    table = made_table({"c": {"time": t, "fy": np.where(t < 3, 20.0, 1.0), "speed": 1.0, "position": t}})
    with pytest.raises(SizingError, match=r"classes=1: they keep the equivalent loads to \d.*%, and 1% is asked for; 2 classes do"):
        ksl.spectra(table, "j").bearing(1)
    two = ksl.spectra(table, "j").bearing(2)
    assert np.allclose(np.hypot(two["Fy"], two["Fz"]), [1, 20], rtol=1e-12), "the longest first"
    for most, said in ((1, "1 classes don't, give more"), (2, "2 classes do")):
        monkeypatch.setattr(bearing_classes, "MOST", most)
        with pytest.raises(SizingError, match=said):
            ksl.spectra(table, "j").bearing(1)


@pytest.mark.parametrize(("jump", "kept"), [(2.0885, True), (2.1157, False)])
def test_one_class_lies_between_both_means(jump, kept):
    """1 N, and for a tenth of the time `jump`: of mean loads B of balls and R of rollers it has √(B R), √(R / B) from each, which is 1.0098 and 1.0102."""
    ball, roller = ((0.9 + 0.1 * jump**p) ** (1 / p) for p in (3, 10 / 3))
    assert ((roller / ball) ** 0.5 < 1.01) == kept
    plain = BearingLoads(np.zeros(2), np.array([[1.0, 0.0], [jump, 0.0]]), np.zeros((2, 2)), np.ones(2), np.array([0.9, 0.1]))
    row = bearing_classes._row(plain, np.arange(2), np.arange(2))
    assert row[2] == pytest.approx((0.9 + 0.1 * jump**10**0.5) ** 10**-0.5, rel=1e-12), "before it is stretched, the mean by an exponent between those of both"
    if kept:
        assert bearing_classes.bearing_classes(plain, 1)["Fy"] == pytest.approx([(ball * roller) ** 0.5], rel=1e-12)
    else:
        with pytest.raises(SizingError, match="classes=1: they keep the equivalent loads to 1.0%, and 1% is asked for; 2 classes do"):
            bearing_classes.bearing_classes(plain, 1)


def test_pauses_are_in_the_one_class_that_is_asked_for():
    """10 N all the time, at 2 rad/s for three quarters of it: its speed is the mean of all of it, so that revolutions are kept."""
    plain = BearingLoads(np.full(4, 10.0), np.zeros((4, 2)), np.zeros((4, 2)), np.array([2.0, 0.0, 2.0, 2.0]), np.full(4, 0.5))
    for classes, shares, speeds in ((1, [1], [1.5]), (2, [0.75, 0.25], [2, 0])):
        found = bearing_classes.bearing_classes(plain, classes)
        np.testing.assert_allclose([found["share"], found["Fx"], found["speed_rpm"]], [shares, [10] * classes, np.multiply(speeds, RPM)], rtol=1e-12)


def test_what_cancels_in_a_class_has_the_size_and_the_way_of_the_first():
    """F turns round where the joint does: in one class are its magnitudes, and the speed without its sign."""
    F, k, way = np.array([3.0, -4.0, 5.0]), np.array(AXIS), np.array([1, 1, -1, -1])
    b = ksl.spectra(
        made_table({"c": {"time": range(4), **{f"f{x}": f * way for x, f in zip("xyz", F)}, "speed": 2.0 * way, "position": range(4)}}), "j"
    ).bearing(1)
    radial = F - (F @ k) * k
    R = bearing_axes(k)
    assert abs(b["Fx"][0]) == pytest.approx(abs(F @ k), rel=1e-12)
    np.testing.assert_allclose([b[c][0] for c in COLUMNS if c != "Fx"], [1, *(R @ radial)[1:], 0, 0, 2 * RPM], rtol=1e-12)
    none, both = np.zeros((2, 2)), np.arange(2)
    row = bearing_classes._row(BearingLoads(np.array([2.0, -2.0]), none, none, np.array([3.0, -3.0]), np.ones(2)), both, both)
    assert row == pytest.approx([1, 2, 0, 0, 0, 0, 3 * RPM])
    for weight in (1e-4, 1e4):  # what rounding leaves of two that cancel has no direction
        for x, direction in (([[1, 0], [-1, 1e-13]], [1, 0]), ([[1, 0], [-1, 1e-3]], [0, 1])):
            np.testing.assert_allclose(bearing_classes._direction(np.array(x), np.full(2, weight)), direction, atol=1e-12)


def test_moments_about_a_point():
    """F = (0, 5, 0) about a point 2 m along x: the moment about z is 5·2 less."""
    table = made_table({"c": {"time": [0, 1, 2], "fy": 5.0, "tz": 3.0, "speed": 1.0, "position": [0, 1, 2]}})
    at = ksl.spectra(table, ["j"], at={"j": (2, 0, 0)})["j"]
    assert at.rainflow_matrix("tz").sum() == 0 and at.samples.moment[:, 2].tolist() == [-7, -7, -7]
    k = np.array(AXIS)
    M = np.array([0, 0, -7.0])
    assert at.bearing_equivalent(3).tilting == pytest.approx(np.linalg.norm(M - (M @ k) * k), rel=1e-14)


def test_rainflow_of_the_standard():
    """ASTM E1049-85, figure 6: −2 1 −3 5 −1 3 −4 4 −2; the case occurs twice, or for an hour."""
    x = [-2, 1, -3, 5, -1, 3, -4, 4, -2]
    table = made_table({"c": {"time": range(9), "fx": x}})
    once = [0.5, 1.5, 0, 0.5, 0, 1.0, 0.5]
    for how, times in (({"cases": {"c": 2}}, 2), ({"shares": {"c": 1}}, 450)):  # 8 s in an hour
        s = ksl.spectra(table, "j", components={"component": [{"kind": "limits", "joint": "j"}], **how})
        found = s.rainflow_matrix("fx", range_edges=[2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5, 9.5], mean_edges=[-5, 5])[:, 0]
        assert found.tolist() == [times * n for n in once]


def test_files(tmp_path):
    found = ksl.spectra(results())
    assert found.write(tmp_path / "s", classes=8) == ["bearings.csv", "durations.csv", "rainflow.csv", "spectra.json"]
    with open(tmp_path / "s/bearings.csv", encoding="utf-8", newline="") as f:
        rows = list(csv.reader(line for line in f if not line.startswith("#")))
    assert rows[0] == ["joint", *COLUMNS] and [float(row[1]) for row in rows[1:]] == found["j"].bearing(8)["share"].tolist()
    with open(tmp_path / "s/durations.csv", encoding="utf-8", newline="") as f:
        durations = list(csv.DictReader(line for line in f if not line.startswith("#")))
    assert sum(float(row["duration"]) for row in durations) == pytest.approx(40)
    s, number = found["j"], lambda row, *names: tuple(float(row[name]) for name in names)
    at = lambda i, j: (*s.torque_edges[i : i + 2], *s.speed_edges[j : j + 2], s.duration[i, j], s.revolutions[i, j])
    of_durations = ("torque_from", "torque_to", "speed_from", "speed_to", "duration", "revolutions")
    assert [number(row, *of_durations) for row in durations] == [at(i, j) for i, j in np.argwhere(s.duration > 0)]
    with open(tmp_path / "s/rainflow.csv", encoding="utf-8", newline="") as f:
        cycles = [row for row in csv.DictReader(line for line in f if not line.startswith("#")) if row["component"] == "ty"]
    counts, (ranges, means) = s.rainflow_matrix("ty"), s.rainflow_edges(s.rainflow("ty"))
    of_cycles = ("range_from", "range_to", "mean_from", "mean_to", "cycles")
    assert [number(row, *of_cycles) for row in cycles] == [(*ranges[i : i + 2], *means[j : j + 2], counts[i, j]) for i, j in np.argwhere(counts > 0)]
    assert {row["unit"] for row in cycles} == {"N m"}
    said = json.loads((tmp_path / "s/spectra.json").read_text(encoding="utf-8"))
    assert said["joints"]["j"]["equivalent"]["p = 3"]["torque"] == found["j"].equivalent(3) and "share of the time" in said["conventions"]["bearings"]
    pytest.importorskip("openpyxl")
    import openpyxl

    found.write(tmp_path / "s", xlsx=True)
    book = openpyxl.load_workbook(tmp_path / "s/spectra.xlsx")
    assert book.sheetnames == ["bearings", "durations", "rainflow", "bearing 1", "About"] and [c.value for c in book["bearing 1"][1]] == COLUMNS
    with pytest.raises(SizingError, match="holds spectra of r, and these are of other"):
        ksl.spectra(results(robot="other")).write(tmp_path / "s")


def test_two_joints_have_points_and_sheets_of_their_own(examples, tmp_path):
    m, t = ksl.load(examples / "robots/ur5.urdf"), np.linspace(0, 4, 81)
    run = ksl.compute_loads(m, (t, *(np.outer(f(2 * t), np.arange(1, 7.0)) for f in (np.sin, lambda x: 2 * np.cos(x), lambda x: -4 * np.sin(x)))))
    names = ["elbow", "wrist_1"]
    plain, moved = ksl.spectra(run, names), ksl.spectra(run, names, at={"elbow": (0.1, 0.2, 0.3)})
    np.testing.assert_array_equal(moved["wrist_1"].samples.moment, plain["wrist_1"].samples.moment)
    s = plain["elbow"].samples
    np.testing.assert_allclose(moved["elbow"].samples.moment, s.moment - np.cross((0.1, 0.2, 0.3), s.force), rtol=1e-9, atol=1e-9)
    import openpyxl

    plain.write(tmp_path / "s", xlsx=True)
    book = openpyxl.load_workbook(tmp_path / "s/spectra.xlsx")
    for k, name in enumerate(names, 1):
        shares = [row[0] for row in book[f"bearing {k}"].iter_rows(values_only=True) if isinstance(row[0], float)]
        np.testing.assert_allclose(shares, plain[name].bearing()["share"], rtol=1e-12)


def test_bad_input():
    table = results()
    for asked, sentence in (
        ({"torque_edges": [1, 1]}, "torque_edges: expected two numbers or more that increase"),
        ({"speed_edges": "fast"}, "speed_edges: expected"),
        ({"at": (0, 0)}, "at needs three finite numbers"),
        ({"on": "both"}, "on"),
    ):
        with pytest.raises(ValueError, match=sentence):
            ksl.spectra(table, "j", **asked)
    with pytest.raises(SizingError, match="no joint named 'k'"):
        ksl.spectra(table, "k")
    s = ksl.spectra(table, "j")
    with pytest.raises(SizingError, match="no component named 'f'"):
        s.rainflow("f")
    with pytest.raises(SizingError, match="classes=0: expected a whole number"):
        s.bearing(0)
    slide = ksl.spectra(made_table({"c": {"time": [0, 1], "effort": 1.0, "speed": 1.0, "position": [0, 1]}}, "prismatic"), "j")
    assert slide.duration.sum() == 1
    for asked in (lambda: slide.revolutions, lambda: slide.bearing()):
        with pytest.raises(SizingError, match="j is prismatic: .* need a joint that turns about one axis"):
            asked()
    fixed = ksl.spectra(made_table({"c": {"time": [0, 1, 2], "fx": [0, 1, 0]}}, "fixed"), "j")
    assert fixed.rainflow("fx").ranges.tolist() == [1, 1]
    with pytest.raises(SizingError, match="j is fixed: classes of torque and speed"):
        fixed.duration.sum()
    with pytest.raises(SizingError, match='on="parent" needs a joint that turns or slides along one axis, and j is spherical'):
        ksl.spectra(made_table({"c": {"time": [0, 1, 2], "fx": [0, 1, 0]}}, "spherical"), "j", on="parent")


def test_what_rigid_bodies_leave_open(examples):
    """A hinge of the excavator: only its radial force is determined."""
    t = np.arange(12.0)
    motion = pa.table({"time": t} | {f"{name}_cylinder": 0.5 + 0.01 * t for name in ("boom", "stick", "bucket")})
    found = ksl.spectra(ksl.compute_loads(examples / "robots/excavator.urdf", motion), ["boom_foot"])
    s = found["boom_foot"]
    assert s.left_open == ("axial", "tilting") and "rigid bodies leave" in found.notes[-1]
    said = found.as_dict()["joints"]["boom_foot"]["equivalent"]["p = 3"]
    assert said["axial"] is None and said["tilting"] is None and said["radial"] == s.bearing_equivalent(3).radial > 1000
