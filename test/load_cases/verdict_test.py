"""The verdict: shares of limits, the worst joint, reasons that forbid green, exit status."""

import re

import numpy as np
import pytest

import ksl
from hinged_rods import LIMITS, joint_of, use
from ksl.load_cases.joint_limits import limits_of
from ksl.load_cases.quantities import joint_loads, summarise
from ksl.load_cases.verdict import Use, Verdict, not_given, number, percent, uses_of
from ksl.mechanism.mechanism import Joint
from ksl_command import run_ksl

MASS, LENGTH, G = 2.0, 0.5, 9.81

PENDULUM = f"""<robot name="pendulum"><link name="wall"/>
<link name="rod"><inertial><origin xyz="{LENGTH} 0 0"/><mass value="{MASS}"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="pin" type="revolute"><parent link="wall"/><child link="rod"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="3" effort="18" velocity="4"/></joint></robot>"""


def hinge(**limits: float) -> Joint:
    return Joint("pin", "revolute", "wall", "rod", 1, 1, 0, 0, (0.0, 1.0, 0.0), has_axis=True, has_angle=True, has_limits=True, **limits)


def uses(joint: Joint, q: np.ndarray, v: np.ndarray, effort: np.ndarray) -> dict[str, Use]:
    t = np.linspace(0, 1, len(q))
    loads = joint_loads(joint, np.zeros((len(q), 6)), v, effort)
    row = {"case": "c", **summarise(t, loads), "position_lowest": q.min(), "position_lowest_time": t[q.argmin()],
           "position_highest": q.max(), "position_highest_time": t[q.argmax()]}  # fmt: skip
    return {use.quantity: use for use in uses_of(joint, row, t, q[:, None])}


def test_shares():
    """Of a range of 4 rad around 1 rad; of 4 rad/s; of 20 N m."""
    q, v, effort = np.array([0.0, 1, 2.8]), np.array([0.0, -3.9, 1]), np.array([5.0, 0, -15])
    found = uses(hinge(lower=-1, upper=3, velocity=4, effort=20), q, v, effort)
    assert {name: use.share for name, use in found.items()} == pytest.approx({"position": 0.9, "speed": 0.975, "effort": 0.75})
    assert {name: use.level for name, use in found.items()} == {"position": "green", "speed": "amber", "effort": "green"}
    assert {name: use.time for name, use in found.items()} == {"position": 1.0, "speed": 0.5, "effort": 1.0}
    verdict = Verdict(tuple(found.values()))
    assert verdict.level == "amber" and verdict.worst is found["speed"] and verdict.exceeded == ()
    assert verdict.headline == "pin uses 97.5 % of its speed limit (3.9 of 4 rad/s) at 0.5 s"


def test_a_limit_of_zero_is_not_given():
    joint = hinge(lower=0, upper=0, velocity=0, effort=0)
    assert uses(joint, np.ones(3), np.ones(3), np.ones(3)) == {}
    limits = limits_of(joint)
    assert (limits.lower, limits.upper, limits.velocity, limits.effort) == (None,) * 4
    assert not_given([joint]) == ["no effort and velocity and position limit of pin in the robot's file (or 0): not compared"]
    assert not_given([hinge(lower=-1, upper=1, velocity=1, effort=1)]) == []


def test_at_the_limit_is_not_beyond_it():
    found = uses(hinge(lower=-1, upper=3, velocity=4), np.array([-1.0, 3]), np.array([4.0, 4]), np.zeros(2))
    assert {use.level for use in found.values()} == {"amber"}
    assert uses(hinge(velocity=4), np.zeros(2), np.array([4.0001, 0]), np.zeros(2))["speed"].level == "red"


def test_one_bound_alone():
    assert uses(hinge(upper=2), np.array([-50.0, 1.5]), np.zeros(2), np.zeros(2))["position"].share == pytest.approx(0.75)
    assert uses(hinge(upper=2), np.array([0.0, 3]), np.zeros(2), np.zeros(2))["position"].share == pytest.approx(1.5)
    assert uses(hinge(lower=0), np.array([0.0, 3]), np.zeros(2), np.zeros(2))["position"].share == pytest.approx(1)


def test_the_worst_is_red_before_it_is_large():
    """A position at 99.9 % is amber; an effort at 101 % is red, a speed at 99 % only amber."""
    found = uses(hinge(lower=-1, upper=1, velocity=1, effort=1), np.array([0.999, 0]), np.array([0.99, 0]), np.array([1.01, 0]))
    verdict = Verdict(tuple(found.values()), ("noise",))
    assert verdict.level == "red" and verdict.worst.quantity == "effort"
    assert [use.exceeded for use in verdict.exceeded] == ["pin: effort 1.01 N m is beyond the effort limit 1 N m"]


def test_reasons_forbid_green():
    small = uses(hinge(velocity=4), np.zeros(2), np.ones(2), np.zeros(2))["speed"]
    assert Verdict((small,)).level == "green"
    assert Verdict((small,), ("the positions are noisy",)).level == "amber"
    assert Verdict((), ()).headline == "no limit could be compared"


def test_cases_are_merged():
    of = lambda case, share: Use(case, "pin", "effort", "pin", share, 20 * share, 20, "effort", "N m", 0)
    verdict = Verdict((of("a", 0.2), of("b", 1.2)))
    assert verdict.of("pin")["effort"].case == "b" and verdict.headline.endswith("case b")
    assert verdict.as_dict()["level"] == "red" and len(verdict.as_dict()["uses"]) == 2


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0, "0.0 %"), (1e-5, "<0.1 %"), (0.00099, "<0.1 %"), (0.001, "0.1 %"), (0.123, "12.3 %"), (1, "100.0 %"), (1 + 0.9e-9, "100.0 %"), (1 + 1.1e-9, "100 %"),
        (1.0001, "100.01 %"), (1.0004, "100.04 %"), (1.3, "130.0 %"), (9.994, "999.4 %"), (10, "1,000 %"), (260, "26,000 %"), (-0.5, "-50.0 %"),
    ],
)  # fmt: skip
def test_percentages(share, text):
    assert percent(share) == text


# the command


def run(folder, q, *options, robot=PENDULUM):
    (folder / "robot.urdf").write_text(robot)
    t = np.linspace(0, 1, len(q))
    np.savetxt(folder / "motion.csv", np.column_stack([t, q]), "%.17g", ",", header="time,pin", comments="")
    return run_ksl("loads", folder / "robot.urdf", folder / "motion.csv", "-o", folder / "out", *options)


def test_a_pendulum_held_level(tmp_path):
    """The drive holds m g l = 9.81 N m: 54.5 % of 18 N m."""
    p = run(tmp_path, np.zeros(8), "--fail-on", "limits")
    assert p.returncode == 0, p.stderr
    assert p.stdout.splitlines()[-1] == "verdict: GREEN: pin uses 54.5 % of its effort limit (9.81 of 18 N m) at 0 s"
    assert MASS * G * LENGTH / 18 == 0.545 and "50.0 %" in p.stdout, "the middle of the range is at 1 rad"
    assert "GREEN" in (tmp_path / "out/report.html").read_text(encoding="utf-8")


def test_degrees_taken_as_radians_are_red_and_fail(tmp_path):
    q = np.rad2deg(np.sin(np.linspace(0, 9, 200)))
    p = run(tmp_path, q, "--fail-on", "limits")
    assert p.returncode == 3 and (tmp_path / "out/report.html").exists()
    *rest, last = p.stdout.splitlines()
    assert last.startswith("verdict: RED: pin uses ") and re.search(r"\d\d,\d{3} % of its", last)
    assert next(line for line in rest if line.startswith("note: ")).startswith("note: pin: position -57.29 rad is beyond the lower limit -1 rad")
    assert run(tmp_path, q).returncode == 0


def test_limits_that_are_not_given_forbid_green(tmp_path):
    p = run(tmp_path, np.zeros(8), robot=PENDULUM.replace('effort="18"', 'effort="0"'))
    lines = p.stdout.splitlines()
    assert lines[-1].startswith("verdict: AMBER: ") and lines[-2] == "  not green: no effort limit of pin in the robot's file (or 0): not compared"
    assert sum("no effort limit of pin" in line for line in lines) == 1, "said once"


def test_notes_are_in_order_of_weight(tmp_path):
    p = run(tmp_path, np.full(8, 4.0), robot=PENDULUM.replace('effort="18"', 'effort="0"').replace("</joint>", "</joint><gazebo/>"))
    notes = [line for line in p.stdout.splitlines() if line.startswith(("  doubt: ", "note: "))]
    assert [next(i for i, word in enumerate(("not compared", "beyond", "differentiated", "not used")) if word in note) for note in notes] == [1, 2, 3, 0], (
        "what concerns the verdict is beside it"
    )


def test_a_payload_in_grams_is_suspected(tmp_path):
    """Below a red verdict, too, the suspicion stands beside it."""
    p = run(tmp_path, np.zeros(8), "--payload", "500,1,0,0", "--on-link", "rod")
    assert (
        p.stdout.splitlines()[-1].startswith("verdict: RED")
        and "the payload on rod has 500 kg" in p.stdout.splitlines()[-2]
        and "grams?" in p.stdout.splitlines()[-2]
    )
    assert "grams?" not in run(tmp_path, np.zeros(8), "--payload", "2", "--on-link", "rod").stdout


def test_fail_on_what(tmp_path):
    p = run(tmp_path, np.zeros(8), "--fail-on", "limit")
    assert (p.returncode, p.stderr) == (2, "ksl: --fail-on limit: expected limits\n")


@pytest.mark.parametrize(("begin", "end", "level"), [(1.0, 1.0, "green"), (0.0, 1.0, "amber"), (1.1, 1.1, "red"), (0.5, 0.5, "green")])
def test_a_joint_that_rests_at_its_stop_needs_no_margin(begin, end, level):
    """A cylinder that is all in throughout; one that moves there is near its limit."""
    b = ksl.Builder("lift").add_link("base").add_link("rod", 2.0, (0, 0, 0), np.diag([0.03, 0.03, 0.03]))
    m = b.add_joint("slide", "prismatic", "base", "rod", axis=(1, 0, 0), limits=(0.0, 1.0), effort=500, velocity=9).build()
    t = np.linspace(0, 2, 41)
    verdict = ksl.compute_loads(m, (t, (begin + (end - begin) * (3 * (t / 2) ** 2 - 2 * (t / 2) ** 3))[:, None])).verdict
    use = verdict.of("slide")["position"]
    assert use.level == level and use.rests == (begin == end) and ("where it rests" in str(use)) == (begin == end != 0.5)


@pytest.mark.parametrize(
    ("quantity", "green", "amber"), [("position", 0.95, 0.9501), ("speed", 0.8, 0.8001), ("effort", 0.8, 0.8001), ("position", 0.0, 1 + 0.9e-9)]
)
def test_colours(quantity, green, amber):
    assert [use(x, quantity).level for x in (green, amber, 1 + 0.9e-9, 1 + 1.1e-9)] == ["green", "amber", "amber", "red"]


def test_what_is_said_of_several_cases_and_joints():
    assert Verdict((use(0.4), use(1.5, case="b"))).headline == "pin uses 150.0 % of its effort limit (30 of 20 N m) at 0.5 s, case b"
    assert Verdict((use(1.2), use(1.5, name="hip"))).headline == "hip uses 150.0 % of its effort limit (30 of 20 N m) at 0.5 s; 2 joints exceed limits"
    assert use(1.5, "position", column="pin.x").exceeded == "pin: x 30 N m is beyond the effort limit 20 N m"
    assert str(use(0.5, "position")) == "pin uses 50.0 % of its position range (10 N m, effort limit 20 N m) at 0.5 s"
    both = Verdict((use(0.3), use(0.2, case="b"), use(0.9, name="hip"), use(0.1, "speed")))
    assert {name: x.share for name, x in both.of("pin").items()} == {"effort": 0.3, "speed": 0.1}


@pytest.mark.parametrize(("count", "said"), [(4, "a, b, c, d"), (5, "a, b, c, d and 1 more")])
def test_names_in_a_sentence(count, said):
    lacking = [joint_of(name, **LIMITS | {"effort": None}) for name in "abcde"[:count]]
    line = f"no effort limit of {said} in the robot's file (or 0): not compared"
    assert not_given([*lacking, joint_of("z", **LIMITS)]) == [line]
    assert not_given([*lacking, joint_of("z", **LIMITS), joint_of("y")], drives=[*"abcde", "z"]) == [line], "y has no drive"
    assert not_given(lacking) == ["no effort limit of any joint in the robot's file (or 0): not compared"]
    assert not_given(lacking[:1]) == ["no effort limit of a in the robot's file (or 0): not compared"]


@pytest.mark.parametrize(
    ("lower", "upper", "ends", "share", "value"),
    [
        (-1, 3, (0.0, 2.5), 0.75, 2.5), (-1, 3, (-0.8, 2.5), 0.9, -0.8), (None, 0.5, (0.0, 0.4), 0.9, 0.4), (None, 4, (0.0, 5.0), 1.25, 5.0),
        (-2, None, (-2.5, 7.0), 1.25, -2.5), (0.25, None, (0.75, 7.0), 0.5, 0.75), (-1, 3, (-1.2, 3.4), 1.1, -1.2),
    ],
)  # fmt: skip
def test_shares_of_positions(lower, upper, ends, share, value):
    """Of a half range, or of one bound in units of its size, 1 rad at least; both where both are beyond."""
    row = {"case": "c", "position_lowest": ends[0], "position_lowest_time": 0.0, "position_highest": ends[1], "position_highest_time": 1.0}
    found = uses_of(joint_of(lower=lower, upper=upper), row, np.arange(2.0), np.zeros((2, 1)))
    assert (found[0].share, found[0].value, found[0].case) == (pytest.approx(share), value, "c")
    assert [x.which for x in found] == (["lower", "upper"] if ends == (-1.2, 3.4) else ["lower" if value in ends[:1] else "upper"])
    assert found[-1].time == (0.0 if found[-1].which == "lower" else 1.0)


def test_positions_of_a_joint_with_several_coordinates():
    narrow = Joint("p", "planar", "a", "b", 3, 3, 0, 0, (0.0, 0.0, 1.0), limits=((0.5, 0.5), (None, None), (None, None)))
    assert [x.share for x in uses_of(narrow, {"case": "c"}, np.arange(2.0), np.array([[0.5, 0, 0], [0.75, 0, 0]]))] == [1.25]
    planar = Joint("p", "planar", "a", "b", 3, 3, 2, 2, (0.0, 0.0, 1.0), limits=((-1.0, 1.0), (None, None), (0.0, 4.0)))
    q = np.zeros((3, 5))
    q[:, 2:] = [[0, 0, 3.5], [0.2, 9, 0.5], [-0.9, 0, 1]]
    found = [(x.column, x.share, x.value, x.time) for x in uses_of(planar, {"case": "c"}, np.arange(3.0), q)]
    assert [x[0] for x in found] == ["p.x", "p.angle"] and [x[2:] for x in found] == [(-0.9, 2.0), (3.5, 0.0)]
    assert [x[1] for x in found] == pytest.approx([0.9, 0.75])


def test_numbers_of_a_row_that_are_zero_or_none():
    assert [number({"x": x}, "x") for x in (0.0, None, 0.05, -3)] == [0.0, 0.0, 0.05, -3.0]
