"""The table of all wrenches, the curves and numbers that sizes are taken from, and the power balance."""

import json
import re

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pytest

import ksl
from ksl.load_cases.curves import Curves
from ksl.load_cases.load_case import BLOCK_ROWS, LoadCase, Placement
from ksl.load_cases.quantities import integral, joint_loads, rms, summarise, unit, work
from ksl.load_cases.verdict import uses_of
from ksl.mechanism.mechanism import Joint
from ksl.motions.motion import Motion, complete

WRENCH = ["fx", "fy", "fz", "tx", "ty", "tz"]
COLUMNS = ["case", "time", "joint", *WRENCH, *(f"constraint_{c}" for c in WRENCH)]
TAIL = ["position", "speed", "acceleration", "effort", "power", "on", "at", "axes"]


@pytest.fixture(scope="module")
def ur5(examples) -> ksl.Model:
    return ksl.load(examples / "robots" / "ur5.urdf")


def sines(m: ksl.Model, n: int = 12):
    """time, q, v, a of a smooth motion."""
    t = np.linspace(0, 1, n)
    w, p = np.arange(1, m.nv + 1) / 2, np.arange(m.nv)
    angle = t[:, None] * w + p
    return t, np.sin(angle), w * np.cos(angle), -(w**2) * np.sin(angle)


# the table


def test_columns_types_and_metadata(ur5):
    table = ur5.wrench_table(*sines(ur5))
    assert table.column_names == COLUMNS + TAIL
    for name in table.column_names:
        words = name in ("case", "joint", "on", "at", "axes")
        assert table.schema.field(name).type == (pa.dictionary(pa.int16(), pa.string()) if words else pa.float64()), name
    said = json.loads(table.schema.metadata[b"ksl"])
    assert {k: said[k] for k in ("version", "robot", "on", "at", "axes", "order")} == {
        "version": ksl.__version__, "robot": "ur5", "on": "child", "at": "joint", "axes": "joint", "order": "lin_ang",
    }  # fmt: skip
    assert "exerted on the child side" in said["wrench"] and "N m" in said["units"]


def test_rows_are_samples_and_in_each_the_joints(ur5):
    t, *state = sines(ur5, 5)
    table = ur5.wrench_table(t, *state)
    names = [j.name for j in ur5.joints]
    assert table.num_rows == 5 * len(names)
    assert table["joint"].to_pylist() == names * 5
    assert table["time"].to_pylist() == [x for x in t for _ in names]
    assert names[-1] == "base"


def wrenches(table: pa.Table, prefix: str, order: tuple[str, ...], joints: int) -> np.ndarray:
    return np.stack([table[prefix + c].to_numpy() for c in order], axis=1).reshape(-1, joints, 6)


@pytest.mark.parametrize(
    "how",
    [
        {},
        {"on": "parent"},
        {"order": "ang_lin"},
        {"axes": "world", "at": "world"},
        {"axes": "tool0", "at": "wrist_1_link"},
        {"at": (0.1, -0.2, 0.3), "order": "ang_lin", "on": "parent", "axes": "world"},
    ],
    ids=str,
)
def test_wrenches_are_those_of_reactions(ur5, how):
    how = {k: (ur5.link_names[4] if x == "wrist_1_link" else x) for k, x in how.items()}
    t, *state = sines(ur5)
    external = {"tool0": np.random.default_rng(0).normal(size=(len(t), 6))}
    table = ur5.wrench_table(t, *state, external=external, **how)
    names = [j.name for j in ur5.joints]
    order = ("fx", "fy", "fz", "tx", "ty", "tz") if how.get("order") != "ang_lin" else ("tx", "ty", "tz", "fx", "fy", "fz")
    assert table.column_names[3:9] == list(order)
    for prefix, part in (("", "total"), ("constraint_", "constraint")):
        assert np.array_equal(wrenches(table, prefix, order, len(names)), ur5.reactions(*state, external, joints=names, part=part, **how)), part
    assert set(table["on"].to_pylist()) == {how.get("on", "child")}
    assert set(table["axes"].to_pylist()) == {how.get("axes", "joint")}
    assert set(table["at"].to_pylist()) == {"joint + 0.1 -0.2 0.3" if not isinstance(how.get("at", ""), str) else how.get("at", "joint")}


def test_effort_speed_power_of_joints_with_one_coordinate(ur5):
    t, q, v, a = sines(ur5)
    table = ur5.wrench_table(t, q, v, a)
    tau = ur5.inverse_dynamics(q, v, a)
    for i, name in enumerate(ur5.joint_names):
        rows = np.array(table["joint"].to_pylist()) == name
        column = lambda c: table[c].to_numpy()[rows]
        assert np.array_equal(column("effort"), tau[:, i])
        for of, x in (("position", q), ("speed", v), ("acceleration", a)):
            assert np.array_equal(column(of), x[:, i]), of
        assert np.array_equal(column("power"), tau[:, i] * v[:, i])
    fixed = [r for r in table.to_pylist() if r["joint"] in ur5.fixed_joint_names]
    assert fixed and all(r[c] is None for r in fixed for c in ("position", "speed", "acceleration", "effort", "power"))


def test_a_floating_base_has_no_effort_but_a_wrench(robot):
    m = robot(
        '<robot name="s"><link name="s"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>',
        floating_base=True,
    )
    t = np.linspace(0, 1, 6)
    q = np.tile([0, 0, 0, 0, 0, 0, 1.0], (6, 1))
    (first, *_) = rows = m.wrench_table(t, q).to_pylist()
    assert len(rows) == 6 and first["joint"] == "floating_base"
    assert first["fz"] == pytest.approx(2 * 9.81) and first["constraint_fz"] == 0 and first["effort"] is None


def test_missing_rates_are_differentiated(ur5):
    t, q, v, a = sines(ur5, 200)
    given, found = ur5.wrench_table(t, q, v, a), ur5.wrench_table(t, q)
    assert np.abs(given["fx"].to_numpy() - found["fx"].to_numpy()).max() < 1e-4
    assert np.abs(given["speed"].drop_null().to_numpy() - found["speed"].drop_null().to_numpy()).max() < 1e-7


def test_long_motions_are_computed_in_blocks_that_fit_together(robot):
    m = robot(PENDULUM)
    n = BLOCK_ROWS // len(m.joints) * 2 + 17
    t = np.linspace(0, 10, n)
    q, v, a = np.sin(t)[:, None], np.cos(t)[:, None], -np.sin(t)[:, None]
    external = {"bob": np.stack([np.sin(k * t) for k in range(6)], axis=1)}
    case = LoadCase(m, Motion(t, q, v, a), external=external)
    assert [len(b.time) for b in case.blocks()] == [BLOCK_ROWS // len(m.joints)] * 2 + [17]
    table = m.wrench_table(t, q, v, a, external=external)
    expected = m.reactions(q, v, a, external, joints=[j.name for j in m.joints])
    assert np.array_equal(wrenches(table, "", ("fx", "fy", "fz", "tx", "ty", "tz"), len(m.joints)), expected)


def test_one_wrench_for_all_samples(ur5):
    t, *state = sines(ur5)
    w = np.arange(6.0)
    assert ur5.wrench_table(t, *state, external={"tool0": w}).equals(ur5.wrench_table(t, *state, external={"tool0": np.tile(w, (len(t), 1))}))


def test_what_loads_refuses(ur5):
    t, q, v, a = sines(ur5)
    for bad in ((t[:-1], q, v, a), (t, q[:, :-1], v, a), (t, q, v[:-1], a), (t[:, None], q, v, a)):
        with pytest.raises(ksl.MotionError, match="shapes don't fit"):
            ur5.wrench_table(*bad)
    with pytest.raises(ksl.MotionError, match="times must increase"):
        ur5.wrench_table(t[::-1], q, v, a)
    with pytest.raises(ksl.MotionError, match="times must increase"):
        ur5.wrench_table(np.zeros_like(t), q, v, a)
    for k in range(4):
        broken = [x.copy() for x in (t, q, v, a)]
        broken[k].flat[3] = np.nan
        with pytest.raises(ksl.MotionError, match="finite"):
            ur5.wrench_table(*broken)
    with pytest.raises(ksl.MotionError, match="5 samples.*needs at least 6"):
        ur5.wrench_table(t[:5], q[:5])
    with pytest.raises(ValueError, match="no link named 'hand'"):
        ur5.wrench_table(t, q, v, a, external={"hand": np.zeros(6)})
    with pytest.raises(ValueError, match="on='both'"):
        ur5.wrench_table(t, q, v, a, on="both")
    with pytest.raises(ksl.MotionError, match=r"q is complex \(complex128\); expected real numbers"):
        ur5.wrench_table(t, q + 0j)
    with pytest.raises(ksl.MotionError, match="time: .*expected an array of numbers"):
        ur5.wrench_table(["now"] * len(t), q)


@pytest.mark.parametrize("shape", [(), (5,), (12, 1), (11, 6), (6, 12), (1, 12, 6)])
def test_external_wrenches_of_another_shape_are_refused(ur5, shape):
    message = re.escape(f"external['tool0'] has shape {shape}; expected (12, 6), a wrench for each sample, or (6)")
    with pytest.raises(ksl.MotionError, match=message):
        ur5.wrench_table(*sines(ur5), external={"tool0": np.zeros(shape)})


def test_external_wrenches_are_finite_and_real(ur5):
    with pytest.raises(ksl.MotionError, match=r"external\['tool0'\] must be finite"):
        ur5.wrench_table(*sines(ur5), external={"tool0": [0, 0, np.nan, 0, 0, 0]})
    with pytest.raises(ksl.MotionError, match=r"external\['tool0'\] is complex"):
        ur5.wrench_table(*sines(ur5), external={"tool0": np.zeros(6, complex)})


# a pendulum

MASS, LENGTH, G = 1.7, 0.8, 9.81

PENDULUM = f"""<robot name="pendulum"><link name="ceiling"/>
<link name="bob"><inertial><origin xyz="0 0 {-LENGTH}"/><mass value="{MASS}"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="pin" type="continuous"><parent link="ceiling"/><child link="bob"/><axis xyz="0 1 0"/><limit effort="0.1" velocity="2"/></joint></robot>"""


def test_pin_of_a_pendulum(robot):
    """The rod pulls with m (g cos θ + l ω²); across it acts m (g sin θ + l θ̈), whose arm is l."""
    m = robot(PENDULUM)
    t = np.linspace(0, 2, 50)
    th, w, dw = 1.2 * np.sin(3 * t), 3.6 * np.cos(3 * t), -10.8 * np.sin(3 * t)
    row = {name: x.to_numpy() for name, x in zip(COLUMNS[3:], m.wrench_table(t, th[:, None], w[:, None], dw[:, None]).columns[3:15])}
    row = {name: x[::2] for name, x in row.items()}  # the pin, without `base`
    pull, across = MASS * (G * np.cos(th) + LENGTH * w**2), MASS * (G * np.sin(th) + LENGTH * dw)
    assert row["fz"] == pytest.approx(pull, rel=1e-12, abs=1e-12)
    # turning about y by θ moves the bob along −x; gravity then pulls along +x of the bob's frame
    assert row["fx"] == pytest.approx(-across, rel=1e-12, abs=1e-12)
    assert row["ty"] == pytest.approx(LENGTH * across, rel=1e-12, abs=1e-12)
    assert np.abs(row["fy"]).max() < 1e-12 and np.abs(row["tx"]).max() < 1e-12 and np.abs(row["tz"]).max() < 1e-12
    assert np.abs(row["constraint_ty"]).max() == 0


def exceeded_limits(m: ksl.Model, motion: Motion) -> list[str]:
    loads = collected(LoadCase(m, motion)).loads
    return [use.exceeded for l in loads for use in uses_of(l.joint, summarise(motion.time, l), motion.time, motion.q) if use.level == "red"]


def test_limits_that_are_exceeded_are_said(robot):
    m = robot(PENDULUM)
    t = np.linspace(0, 2, 50)
    motion = Motion(t, 1.2 * np.sin(3 * t)[:, None], 3.6 * np.cos(3 * t)[:, None], -10.8 * np.sin(3 * t)[:, None])
    lines = exceeded_limits(m, motion)
    assert lines[0] == "pin: speed 3.6 rad/s is beyond the velocity limit 2 rad/s"
    assert lines[1].startswith("pin: effort ") and lines[1].endswith(" N m is beyond the effort limit 0.1 N m") and len(lines) == 2
    slow = Motion(t, 0 * motion.q, 0 * motion.v, 0 * motion.a)
    assert exceeded_limits(m, slow) == []


def test_positions_beyond_their_limits_are_said(robot):
    m = robot(PENDULUM.replace("continuous", "revolute").replace('effort="0.1"', 'lower="-1" upper="0.5" effort="500"'))
    t = np.linspace(0, 2, 50)
    motion = Motion(t, np.linspace(-2, 1, 50)[:, None], np.zeros((50, 1)), np.zeros((50, 1)))
    assert exceeded_limits(m, motion) == ["pin: position -2 rad is beyond the lower limit -1 rad", "pin: position 1 rad is beyond the upper limit 0.5 rad"]


# the power balance


def collected(case: LoadCase) -> Curves:
    curves = Curves(case)
    for block in case.blocks():
        curves.add(block)
    return curves


def test_power_balance_with_external_wrenches(robot):
    m = robot(PENDULUM)
    t = np.linspace(0, 2, 400)
    q, v, a = np.sin(3 * t)[:, None], 3 * np.cos(3 * t)[:, None], -9 * np.sin(3 * t)[:, None]
    w = np.stack([np.cos(t), np.sin(t), t, t**2, np.sin(2 * t), -t], axis=1)
    balance = collected(LoadCase(m, Motion(t, q, v, a), Placement("parent", "world", "world", "ang_lin"), {"bob": w})).power_balance()
    assert balance.relative_residual < 1e-7
    assert balance.external == pytest.approx(w[:, 4] * v[:, 0], rel=1e-12, abs=1e-12)  # the bob's frame turns about its own origin
    kinetic, potential = m.energy(q, v)
    assert np.array_equal(balance.energy, kinetic + potential)


def test_power_balance_with_damping_and_external_wrenches(robot):
    """What drives and wrenches supply, less what is lost, is the rate of the energy."""
    m = robot(PENDULUM.replace("</joint>", '<dynamics damping="0.7"/></joint>'), physics="damping")
    t = np.linspace(0, 2, 400)
    q, v, a = np.sin(3 * t)[:, None], 3 * np.cos(3 * t)[:, None], -9 * np.sin(3 * t)[:, None]
    balance = collected(LoadCase(m, Motion(t, q, v, a), external={"bob": np.tile([1.0, 2, 3, 4, 5, 6], (400, 1))})).power_balance()
    assert balance.relative_residual < 1e-7 and balance.dissipation == pytest.approx(0.7 * v[:, 0] ** 2, rel=1e-12)


def test_numbers_don_t_depend_on_when_the_clock_begins(robot):
    """Means are over the time that a motion lasts."""
    m, t = robot(PENDULUM), np.linspace(0, 2, 301)
    motion = np.sin(3 * t)[:, None], 3 * np.cos(3 * t)[:, None], -9 * np.sin(3 * t)[:, None]
    first, later = (ksl.compute_loads(m, (t + begin, *motion)) for begin in (0.0, 64.0))
    for x, y in zip(first.rows, later.rows, strict=True):
        numbers = {name: value for name, value in x.items() if isinstance(value, float)}
        assert len(numbers) >= 5 and all(
            y[name] - (64.0 if "time" in name else 0.0) == pytest.approx(value, rel=1e-9, abs=1e-12, nan_ok=True) for name, value in numbers.items()
        )
    assert first.rows[0]["effort_rms"] == pytest.approx(np.sqrt(np.trapezoid(m.inverse_dynamics(*motion)[:, 0] ** 2, t) / 2), rel=1e-5)


def test_power_balance_notices_a_wrong_velocity(robot):
    """It is a proof: rates that don't belong to the positions show."""
    m = robot(PENDULUM)
    t = np.linspace(0, 2, 400)
    q, v, a = np.sin(3 * t)[:, None], 3 * np.cos(3 * t)[:, None], -9 * np.sin(3 * t)[:, None]
    assert collected(LoadCase(m, Motion(t, q, v, a))).power_balance().relative_residual < 1e-7
    assert collected(LoadCase(m, Motion(t, q, 1.01 * v, a))).power_balance().relative_residual > 1e-3
    assert collected(LoadCase(m, Motion(t, q, v, 1.01 * a))).power_balance().relative_residual > 1e-3


@pytest.mark.parametrize("angle", [0.3, np.pi / 2], ids=["hangs aside", "level: no energy"])
@pytest.mark.parametrize("dt", [1e-4, 1e-2, 1.0])
def test_a_mechanism_at_rest_balances(robot, angle, dt):
    """What differentiation makes of round-off is no residual: neither that of the energy nor that of the speed."""
    m = robot(PENDULUM)
    t = dt * np.arange(300)
    q = np.full((300, 1), angle)
    at_rest = collected(LoadCase(m, complete(m, t, q, [[None, None]]))).power_balance()
    assert at_rest.at_rest and at_rest.relative_residual < 1e-2
    moving = collected(LoadCase(m, complete(m, t, q + 1e-3 * np.sin(t / dt / 9)[:, None], [[None, None]]))).power_balance()
    assert not moving.at_rest and moving.round_off < 1e-6 * moving.largest_power


def test_no_power_balance_of_too_few_samples(robot):
    m = robot(PENDULUM)
    t = np.linspace(0, 1, 5)
    x = np.zeros((5, 1))
    assert collected(LoadCase(m, Motion(t, x, x, x))).power_balance() is None


def test_sample_motion_balances(ur5, examples):
    from ksl.motions.reading import read_motion

    balance = collected(LoadCase(ur5, read_motion(ur5, examples / "motions" / "ur5_pick.csv"))).power_balance()
    assert balance.relative_residual < 1e-4


def test_curves_don_t_depend_on_axes_and_order(ur5):
    """Axial, radial, bending are about the joint's axis whatever the table's axes; the side changes signs only."""
    t, *state = sines(ur5)
    motion = Motion(t, *state)
    plain = collected(LoadCase(ur5, motion))
    turned = collected(LoadCase(ur5, motion, Placement(axes="world", order="ang_lin")))
    parent = collected(LoadCase(ur5, motion, Placement(on="parent")))
    other = collected(LoadCase(ur5, motion, Placement(order="ang_lin")))
    for p, w, n, o in zip(plain.loads, turned.loads, parent.loads, other.loads):
        for name, x in p.wrench.items():
            assert w.wrench[name] == pytest.approx(x, rel=1e-12, abs=1e-12) and o.wrench[name] == pytest.approx(x, rel=1e-12, abs=1e-12)
            assert n.wrench[name] == pytest.approx(-x if name in ("axial_force", "axial_moment") else x, rel=1e-12, abs=1e-12)
        if p.effort is not None:
            assert np.array_equal(p.effort, n.effort), "effort is the motor's, on whatever side wrenches are given"
            assert np.array_equal(p.power, p.effort * p.speed)


# quantities


def joint(kind: str, axis=(0.0, 0.0, 1.0)) -> Joint:
    n, turns = (1, kind != "prismatic") if kind in ("revolute", "prismatic", "continuous", "helical") else (0, False)
    return Joint("j", kind, "a", "b", n, n, 0, 0, axis, has_axis=n == 1, has_angle=turns)


@pytest.mark.parametrize("kind", ["revolute", "continuous", "prismatic"])
def test_parts_of_a_wrench_by_the_axis(kind):
    w = np.array([[1.0, 2, 3, 4, 5, 6], [-1, -2, -3, -4, -5, -6]])
    found = joint_loads(joint(kind), w, None, None).wrench
    assert found["axial_force"] == pytest.approx([3, -3]) and found["axial_moment"] == pytest.approx([6, -6])
    assert found["radial_force"] == pytest.approx([np.sqrt(5)] * 2) and found["bending_moment"] == pytest.approx([np.sqrt(41)] * 2)
    oblique = joint_loads(joint(kind, (0.6, 0.0, 0.8)), w[:1], None, None).wrench
    assert oblique["axial_force"] == pytest.approx([3.0]) and oblique["radial_force"] == pytest.approx([np.sqrt(14 - 9)])
    assert oblique["axial_moment"] == pytest.approx([7.2]) and oblique["bending_moment"] == pytest.approx([np.sqrt(77 - 7.2**2)])


@pytest.mark.parametrize("kind", ["fixed", "floating"])
def test_wrench_without_an_axis(kind):
    found = joint_loads(joint(kind, (0.0, 0.0, 0.0)), np.array([[1.0, 2, 2, 2, 3, 6]]), None, None).wrench
    assert set(found) == {"force", "moment"} and found["force"] == pytest.approx([3]) and found["moment"] == pytest.approx([7])


def test_units():
    kinds = [joint(kind) for kind in ("revolute", "continuous", "prismatic", "helical")]
    assert [unit("speed", j) for j in kinds] == ["rad/s", "rad/s", "m/s", "rad/s"]
    assert [unit("effort", j) for j in kinds] == ["N m", "N m", "N", "N m"]
    assert [unit("axial_moment", kinds[0]), unit("axial_force", joint("fixed"))] == ["N m", "N"]


def test_work_of_a_sine_power():
    t = np.linspace(0, 2 * np.pi, 4001)
    assert work(t, np.sin(t)) == pytest.approx((2, -2), rel=1e-6)
    assert work(t, np.sin(t) + 2) == pytest.approx((4 * np.pi, 0), abs=1e-12)


def test_work_of_a_power_that_is_linear_between_samples_is_exact():
    t = np.array([0.0, 1, 3, 4])
    # two triangles of height 3 and 1 around each sign change, 3/4 and 1/4 of the way
    assert work(t[:2], np.array([3.0, -1])) == pytest.approx((1.125, -0.125), abs=1e-15)
    assert work(t[:2], np.array([-1.0, 3])) == pytest.approx((1.125, -0.125), abs=1e-15)
    assert work(t, np.array([3.0, -1, -1, 0])) == pytest.approx((1.125, -0.125 - 2 - 0.5), abs=1e-15)
    assert work(t, np.zeros(4)) == (0, 0)
    assert work(t, np.array([0.0, 2, 0, 2])) == pytest.approx((1 + 2 + 1, 0), abs=1e-15)


def test_rms_counts_samples_by_their_time():
    t = np.array([0.0, 0.1, 0.11, 0.12, 5, 10])
    assert rms(t, np.full(6, -3.0)) == pytest.approx(3, rel=1e-15)
    rng = np.random.default_rng(0)
    t = np.sort(np.concatenate([[0, 2 * np.pi], rng.uniform(0, 1, 3000), rng.uniform(0, 2 * np.pi, 3000)]))
    assert rms(t, np.sin(t)) == pytest.approx(np.sqrt(0.5), rel=1e-4), "half of the samples lie in the first second"
    assert integral(t, np.sin(t) ** 2) == pytest.approx(np.pi, rel=1e-4)


def test_a_row_of_the_summary():
    t = np.linspace(0, 2 * np.pi, 2001)
    w = np.zeros((2001, 6))
    w[:, 2], w[:, 5] = -3 * np.cos(t / 2), 2 * np.sin(t)
    row = summarise(t, joint_loads(joint("revolute"), w, speed=np.sin(t), effort=3 * np.sin(t)))
    assert (row["joint"], row["kind"]) == ("j", "revolute")
    assert row["axial_force_peak"] == pytest.approx(3) and row["axial_force_peak_time"] == 0
    assert row["axial_moment_peak"] == pytest.approx(2, rel=1e-6) and row["axial_moment_peak_time"] == pytest.approx(np.pi / 2, rel=1e-3)
    assert row["axial_moment_rms"] == pytest.approx(np.sqrt(2), rel=1e-6)
    assert row["effort_peak"] == pytest.approx(3, rel=1e-6) and row["effort_peak_time"] == pytest.approx(np.pi / 2, rel=1e-3)
    assert row["effort_rms"] == pytest.approx(3 / np.sqrt(2), rel=1e-6)
    assert row["speed_peak"] == pytest.approx(1, rel=1e-6) and row["power_peak"] == pytest.approx(3, rel=1e-6)
    assert row["work_positive"] == pytest.approx(3 * np.pi, rel=1e-6) and row["work_negative"] == pytest.approx(0, abs=1e-12)
    assert row["power_mean"] == pytest.approx(1.5, rel=1e-6)
    assert list(summarise(t, joint_loads(joint("fixed"), w, None, None))) == [
        "joint", "kind", "force_peak", "force_peak_time", "force_rms", "moment_peak", "moment_peak_time", "moment_rms",
    ]  # fmt: skip


GRIPPER = """<robot name="gripper"><link name="palm"/>
<link name="left"><inertial><mass value="0.5"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="right"><inertial><mass value="0.2"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="finger" type="prismatic"><parent link="palm"/><child link="left"/><axis xyz="0 0 1"/><limit lower="0" upper="1" effort="9" velocity="9"/></joint>
<joint name="follower" type="prismatic"><parent link="palm"/><child link="right"/><axis xyz="0 0 1"/><limit lower="-1" upper="0" effort="9" velocity="1"/>
<mimic joint="finger" multiplier="-2" offset="0.1"/></joint></robot>"""


def test_a_mimic_joint_has_a_coupling_and_no_drive(tmp_path):
    (tmp_path / "gripper.urdf").write_text(GRIPPER)
    m = ksl.load(tmp_path / "gripper.urdf")
    time = np.linspace(0, 1, 21)
    q = 0.5 + 0.4 * np.sin(3 * time)[:, None]
    v, a = 1.2 * np.cos(3 * time)[:, None], -3.6 * np.sin(3 * time)[:, None]
    table = m.wrench_table(time, q, v, a)
    rows = {name: table.filter(pc.equal(table["joint"], name)) for name in ("finger", "follower")}
    coupling = 0.2 * (9.81 - 2 * a[:, 0])  # what lifts the follower
    assert rows["follower"]["coupling"].to_numpy() == pytest.approx(coupling)
    assert rows["follower"]["speed"].to_numpy() == pytest.approx(-2 * v[:, 0])
    assert rows["follower"]["effort"].null_count == len(time) == rows["finger"]["coupling"].null_count
    effort = 0.5 * (9.81 + a[:, 0]) - 2 * coupling  # of the drive, which moves both
    assert rows["finger"]["effort"].to_numpy() == pytest.approx(effort)
    assert rows["finger"]["power"].to_numpy() == pytest.approx(effort * v[:, 0])
