"""The verdict: shares of limits, the worst joint, reasons that forbid green, exit status."""

import re

import numpy as np
import pytest

import ksl
from ksl.load_cases.joint_limits import limits_of
from ksl.load_cases.quantities import joint_loads, summarise
from ksl.load_cases.verdict import Use, Verdict, not_given, percent, uses_of
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
    ("share", "text"), [(0, "0.0 %"), (1e-5, "<0.1 %"), (0.123, "12.3 %"), (1, "100.0 %"), (1.0001, "100.01 %"), (1.3, "130.0 %"), (260, "26,000 %")]
)
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
