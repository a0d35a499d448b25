"""Motions of mechanisms with loops: joints that follow the drives, against the closed form of a slider-crank, and what is said of them."""

import re
import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from linkages import FOURBAR, FREE_COUPLER, SLIDE, SLIDERCRANK, joint, link, loop

from ksl.base.errors import MotionError
from ksl.mechanism.freedoms import freedoms
from ksl.motions.closed_motion import Follower, _allowed, _some, closed, closed_again, completed, follow_by_loops, followed, held_by, keeps_closed, leading
from ksl.motions.closing import Held, NotClosed, closed_along, closed_side_by_side, determining, first_closed, home
from ksl.motions.generate import Waypoints, minimum_jerk, trapezoid
from ksl.motions.generate.generated import beyond_limits
from ksl.motions.reading import read_motion
from ksl.motions.signal.rates import derivative

CRANK, ROD, OFFSET = 0.1, 0.25, 0.02
TIME = np.linspace(0, 2, 401)
TURN = 2 * np.pi * (TIME / 2 - np.sin(np.pi * TIME) / (2 * np.pi)), np.pi * (1 - np.cos(np.pi * TIME)), np.pi**2 * np.sin(np.pi * TIME)
"""A whole turn from rest to rest, and its rates."""
DRIVE = np.array([True, False, False])
TINY = 1e-12
"""A speed at which nobody can say whether a joint moves."""


def of_crank(angle, speed=0.0, acceleration=0.0):
    """Positions, velocities and accelerations (…, 3) of crank, rod and slider: the rod turns by φ against the crank, ROD sin(θ + φ) = OFFSET − CRANK sin θ."""
    height, height1 = OFFSET - CRANK * np.sin(angle), -CRANK * np.cos(angle) * speed
    height2 = CRANK * (np.sin(angle) * speed**2 - np.cos(angle) * acceleration)
    reach = np.sqrt(ROD**2 - height**2)
    reach1 = -height * height1 / reach
    reach2 = -(height1**2 + height * height2 + reach1**2) / reach
    whole, whole1 = np.arcsin(height / ROD), height1 / reach
    whole2 = (height2 - whole1 * reach1) / reach
    slide = [
        CRANK * np.cos(angle) + reach,
        -CRANK * np.sin(angle) * speed + reach1,
        -CRANK * (np.cos(angle) * speed**2 + np.sin(angle) * acceleration) + reach2,
    ]
    turns = [(angle, whole - angle), (speed, whole1 - speed), (acceleration, whole2 - acceleration)]
    return [np.stack(np.broadcast_arrays(*turn, x), axis=-1) for turn, x in zip(turns, slide, strict=True)]


@pytest.fixture
def crank(robot):
    return robot(SLIDERCRANK, drives=["A"])


@pytest.mark.parametrize("speed", [1.0, TINY])
def test_rates_are_taken_as_none_where_loops_stay_closed(crank, speed):
    """All of a mechanism, or none: also in long motions, where one sample stands and the next does not."""
    angle = np.linspace(0.3, 2.8, 3000)
    q, v, _ = of_crank(angle, speed)
    everything = np.ones((3000, 3), dtype=bool)
    everything[1::2] = False
    assert np.array_equal(keeps_closed(crank, q, v, everything), everything)
    for alone in range(3):
        one = np.zeros((3000, 3), dtype=bool)
        one[:, alone] = True
        assert not keeps_closed(crank, q, v, one).any() and np.array_equal(keeps_closed(crank, q, 0 * v, one), one)
    tree = crank.without_loops()
    assert np.array_equal(keeps_closed(tree, q, v, one), one)


@pytest.mark.parametrize(("share", "kept"), [(0.95e-9, True), (1.05e-9, False)])
def test_rates_that_nearly_cancel_keep_loops_closed(share, kept):
    """Within a billionth of the sum of their sizes: 1 + s less 1 − s is 2 s, of 2."""
    model = SimpleNamespace(loops=(1,), loop_jacobian=lambda q: np.tile([[[1.0, -1.0]]], (len(q), 1, 1)))
    both = np.ones((1, 2), dtype=bool)
    assert (keeps_closed(model, np.zeros((1, 2)), np.array([[1 + share, 1 - share]]), both) == kept).all()


def made(model, q, time=TIME, known=(True, False, False), rates=None):
    """The motion where the columns of some joints are known; others are at zero."""
    q = np.where(known, q, 0.0)
    given = [[None, None]] * 3 if rates is None else [[x[:, :1] for x in rates], [None, None], [None, None]]
    return completed(model, time, q, given, np.array(known))


@pytest.mark.parametrize("step", [1, 20, 50])
def test_joints_that_follow_a_crank_are_those_of_the_closed_form(crank, step):
    """In steps of a degree, which are closed side by side, and of up to 0.6 and 1.4 rad, one by one."""
    expected = [x[::step] for x in of_crank(*TURN)]
    found = made(crank, expected[0], TIME[::step], rates=expected[1:])
    for x, of in zip((found.q, found.v, found.a), expected, strict=True):
        assert x == pytest.approx(of, abs=1e-8)
    closing = found.closing
    assert closing.held == ("A",) and closing.freedoms == 1 and closing.error < 1e-10 and closing.error_time in TIME and closing.compared == ()
    assert "positions of B, S closed from those of A; rates, too" in found.differentiated
    assert closed_along(held_by(crank), np.where(DRIVE, expected[0], 0.0), expected[0][0]) == pytest.approx(expected[0], abs=1e-9)


@pytest.mark.parametrize("samples", [1, 2, 3, 30, 100, 400])
@pytest.mark.parametrize("step", [0.0, 1e-3, 0.03, 0.066, 0.067, 0.3])
def test_samples_are_closed_side_by_side_where_steps_are_small(crank, samples, step):
    """Every so many one after the other, and those between at once: so many that the drive moves by 0.2 rad, √n at most, and three at least."""
    expected = of_crank(0.3 + step * np.arange(samples))[0]
    held, calls = held_by(crank), []
    counting = replace(held, model=SimpleNamespace(nq=3, difference=crank.difference, close=lambda *a, **how: calls.append(1) or crank.close(*a, **how)))
    assert closed_along(counting, np.where(DRIVE, expected, 0.0), expected[0]) == pytest.approx(expected, abs=1e-8)
    stride = int(min(np.sqrt(samples), 0.2 / step if step and samples > 1 else np.inf))
    assert len(calls) == (samples if stride < 3 else -(-samples // stride) + stride)


def watched(crank, fails=lambda q: False, off=0.0):
    """The held crank, of whose calls of `close` the first arguments are listed; some fail, and those side by side are off by so much."""
    calls = []

    def close(q, hold, starts):
        calls.append(np.array(q))
        found = crank.close(q, hold=hold, starts=starts)
        return SimpleNamespace(q=found.q + off * (np.ndim(q) == 2), converged=found.converged & np.logical_not(fails(q)), reason=found.reason)

    also = ("nq", "neutral", "lower", "upper", "difference", "interpolate", "loop_error", "loops", "branches")
    return replace(held_by(crank), model=SimpleNamespace(close=close, **{name: getattr(crank, name) for name in also})), calls


@pytest.mark.parametrize(("angle", "steps"), [(0.0, 1), (0.95, 10), (-1.05, 11), (49.95, 500), (60.0, 500)])
def test_the_first_position_is_reached_in_steps_of_a_tenth(robot, angle, steps):
    """500 at most, equal ones; of a crank that has limits, and so turns more than once on its way."""
    limited = joint("A", "frame", "crank", "0 0 0", "revolute", limit='<limit lower="-99" upper="99" effort="5" velocity="9"/>')
    held, calls = watched(robot(SLIDERCRANK.replace(joint("A", "frame", "crank", "0 0 0"), limited), drives=["A"]))
    expected = of_crank(angle)[0]
    q = first_closed(held, np.where(DRIVE, expected, 0.0))
    assert q[[0, 2]] == pytest.approx(expected[[0, 2]], abs=1e-9)
    assert np.array(calls)[1:, 0] == pytest.approx(angle * np.arange(1, steps + 1) / steps)


def test_a_step_that_fails_is_made_in_eight(crank):
    """Here one of more than 0.13 rad."""
    last = [of_crank(0.3)[0][0]]

    def fails(q):
        far = abs(q[0] - last[0]) > 0.13
        last[0] = last[0] if far else q[0]
        return far

    held, calls = watched(crank, fails)
    q = closed_along(held, np.array([[0.3, 0, 0], [1.3, 0, 0]]), of_crank(0.3)[0])
    assert q == pytest.approx(of_crank(np.array([0.3, 1.3]))[0], abs=1e-9)
    assert np.array(calls)[:, 0] == pytest.approx([0.3, 1.3, *(0.3 + np.arange(1, 9) / 8)])
    held, calls = watched(crank, lambda q: q[0] > 0.6)
    with pytest.raises(NotClosed, match=r"with A = 1\.3 rad no closed position was found: loop joint C stays open"):
        closed_along(held, np.array([[0.3, 0, 0], [1.3, 0, 0]]), of_crank(0.3)[0])
    assert len(calls) == 5, "none behind the first of the eight that fails"


@pytest.mark.parametrize(("off", "fails", "again"), [(0.95e-6, False, False), (1.05e-6, False, True), (0.0, True, True)])
def test_ways_side_by_side_must_meet(crank, off, fails, again):
    """Within 1e-6 at the samples that were closed one after the other, and at every one: otherwise all are closed so."""
    expected = of_crank(0.3 + 0.03 * np.arange(30))[0]
    held, calls = watched(crank, lambda q: np.full(len(q), fails) if np.ndim(q) == 2 else False, off)
    q = closed_along(held, np.where(DRIVE, expected, 0.0), expected[0])
    behind = np.arange(30) > 0
    assert q - expected == pytest.approx(np.where(behind & (not again), off, 0.0)[:, None] * np.ones(3), abs=1e-9)
    assert len([c for c in calls if c.ndim == 1]) == (36 if again else 6)


@pytest.mark.parametrize(("share", "moves"), [(0.95e-6, False), (1.05e-6, True)])
def test_a_joint_determines_motions_that_move_it(share, moves):
    """By more than a millionth of them: here the first joint moves by so much of the second."""
    joints = [SimpleNamespace(v_index=k, nv=1) for k in range(2)]
    model = SimpleNamespace(nv=2, loop_jacobian=lambda q: np.array([[1.0, -share]]), mobility=lambda q: SimpleNamespace(rank=1))
    assert determining(model, np.zeros(2), joints) == (joints[0] if moves else joints[1],)


def test_joints_of_several_coordinates_are_held_by_all_of_them():
    """Those of a body that floats, behind two joints."""
    held = Held(SimpleNamespace(), (SimpleNamespace(q_index=2, nq=7, v_index=2, nv=6), SimpleNamespace(q_index=10, nq=1, v_index=9, nv=1)))
    assert held.columns.tolist() == [2, 3, 4, 5, 6, 7, 8, 10] and held.rates.tolist() == [2, 3, 4, 5, 6, 7, 9]
    assert held.put(np.zeros(11), np.arange(1.0, 12)).tolist() == [0, 0, 3, 4, 5, 6, 7, 8, 9, 0, 11]


def test_what_is_differentiated_is_the_drive_alone(crank):
    """Rates of the others follow from its own; what is said names it."""
    expected = of_crank(*TURN)
    found = made(crank, expected[0])
    assert (
        np.array_equal(found.v[5:-5, 0], derivative(TIME, TURN[0])[5:-5])
        and found.v == pytest.approx(expected[1], abs=1e-5)
        and found.a == pytest.approx(expected[2], abs=1e-2)
    )
    assert "velocities and accelerations of A differentiated from a quintic spline through the samples" in found.differentiated
    assert found.resolution[0] > 0 and (found.resolution[1:] == 0).all(), "what follows has the resolution of none"
    stands = made(crank, of_crank(np.maximum(TIME - 1, 0) ** 3)[0]).stands
    assert stands[:150].all() and not stands[300:].any() and (stands == stands[:, :1]).all(), "all stand where the drive does"


@pytest.mark.parametrize(("joint", "other"), [("B", "S"), ("S", "B")])
def test_positions_of_joints_that_follow_are_compared(crank, joint, other):
    """Told from 1e-6 on, and doubted from 1e-2 on, rad, or lengths of the mechanism; whole turns of hinges are none."""
    q = of_crank(TURN[0])[0]
    k, length = crank.joint_names.index(joint), crank.mobility(q[0]).length
    for off, told, doubted in ((0.99e-6, False, False), (1.01e-6, True, False), (0.99e-2, True, False), (-1.01e-2, True, True)):
        moved = q.copy()
        moved[100, k] += off * (1.0 if joint == "B" else length)
        moved[:, 1] += 4 * np.pi * (joint == "B")
        found = made(crank, moved, known=(True, True, True))
        size = abs(off) * (1.0 if joint == "B" else length)
        line = f"positions of {joint} in the motion differ from those that follow by up to {size:.3g} {'rad' if joint == 'B' else 'm'}, at 0.5 s"
        assert (line in found.differentiated) == (told and not doubted)
        assert found.contradictions == [f"{line}: check dimensions, offsets and the branch; those that follow are used"] * doubted
        same = [line for line in found.differentiated if "in the motion are those that follow, within" in line]
        assert sum(other in line for line in same) == 1 and any(joint in line for line in same) != told


def test_whole_turns_are_none_of_hinges_alone(crank):
    q = of_crank(TURN[0])[0]
    q[100] += [0, 2 * np.pi, 2 * np.pi]
    told = "positions of S in the motion differ from those that follow by up to 6.28 m, at 0.5 s: check dimensions, offsets and the branch; those that follow are used"
    assert made(crank, q, known=(True, True, True)).contradictions == [told]


def test_the_branch_is_that_of_the_first_sample_where_all_is_given(crank):
    """The rod may point back: the slider is then on the other side of the crank."""
    angle = 0.3 * np.sin(TIME)
    reach = np.sqrt(ROD**2 - (OFFSET - CRANK * np.sin(angle)) ** 2)
    other = np.column_stack([angle, np.pi - np.arcsin((OFFSET - CRANK * np.sin(angle)) / ROD) - angle, CRANK * np.cos(angle) - reach])
    model = crank
    found = made(model, other, known=(True, True, True))
    assert found.q[:, 2] == pytest.approx(other[:, 2], abs=1e-9) and found.contradictions == []
    assert made(model, other).q[:, 2] == pytest.approx(CRANK * np.cos(angle) + reach, abs=1e-9), "else it is that of the neutral position"


def test_which_joints_are_held(robot):
    """Of drives that follow from each other the first ones; of too few the freedoms that are left are counted."""
    for drives, held, follow in ((["A"], ["A"], [1, 2]), (["A", "D"], ["A"], [1]), (["D", "A"], ["D"], [1])):
        model = robot(FOURBAR, drives=drives)
        assert (
            held_by(model).names == held and follow_by_loops(model).tolist() == follow and [j.name for j in leading(model)] == [n for n in "AD" if n in drives]
        )
        assert [j.name for j in determining(model, home(model), model.joints[:3])] == ["A"]
    assert [j.name for j in leading(robot(FOURBAR))] == ["A", "B", "D"], "all where drives aren't known"
    fourbar = robot(FOURBAR, drives=["A"])
    turn, ball = fourbar.joints[0], replace(fourbar.joints[1], nq=4, q_index=1)
    assert follow_by_loops(SimpleNamespace(loops=fourbar.loops, drives=("A",), joint_names=["A", "B"], joints=(turn, ball))).tolist() == [1, 2, 3, 4]
    tip = FOURBAR.replace("</robot>", link("tip", 0.2, 0.1) + joint("T", "coupler", "tip", "0.1 0 0") + "</robot>")
    assert freedoms(robot(tip)) == 2 and held_by(robot(tip, drives=["T", "A"])).names == ["T", "A"]
    for text, drives, said, others in (
        (tip, ["A"], "2 freedoms, and drives A leave 1 of them open", "T"),
        (tip, [], "2 freedoms, and no drives leave 2 of them open", "A, B, T, D"),
        (FOURBAR, [], "1 freedom, and no drives leave 1 of it open", "A, B, D"),
    ):
        with pytest.raises(MotionError, match=rf"the mechanism has {said}; name more: --drives .*, from among {others}$"):
            held_by(robot(text, drives=drives))
    flying = robot(FOURBAR, drives=["A"], floating_base=True)
    body = flying.joint_names[0]
    assert held_by(flying).names == [body, "A"] == [j.name for j in held_by(flying).joints], "what floats first"
    with pytest.raises(MotionError, match=r"the mechanism has 7 freedoms, and no drives leave 1 of them open; .*, from among A, B, D$"):
        held_by(robot(FOURBAR, drives=[], floating_base=True))


def test_limits_are_told_of_held_joints_that_have_some(robot):
    model = robot(SLIDERCRANK, drives=["S"])
    crank, _, slider = model.joints[:3]
    assert _allowed(Held(model, (crank,))) == "; choose narrower waypoints"
    assert (
        _allowed(Held(model, (crank, slider)))
        == "; the limits allow S from 0 to 1 m, which may be more than can be reached: choose narrower waypoints or limits"
    )


def test_trees_follow_nothing(crank):
    motion = made(crank, of_crank(TURN[0])[0])
    assert closed(crank.without_loops(), motion) is motion


def test_several_motions_side_by_side(crank, robot):
    """Each from its own first position; of one that leaves the reach what was found before it does."""
    angle = np.array([0.2, 0.5, -0.3])[:, None] + 0.1 * np.arange(5)
    held = held_by(crank)
    expected = of_crank(angle)[0]
    q, found = closed_side_by_side(held, np.where(DRIVE, expected, 0.0), expected[:, 0])
    assert found.all() and q == pytest.approx(expected, abs=1e-9)
    closing = made(crank, of_crank(TURN[0])[0]).closing
    speed = np.array([[[1.0], [2.0], [-1.0]]]).reshape(3, 1) + 0 * angle
    of = of_crank(angle, speed, -speed)
    moved = [np.where(DRIVE, x, 0.0) for x in of]
    for x, y in zip(followed(crank, closing, of[0][:, 0], moved), of, strict=True):
        assert x == pytest.approx(y, abs=1e-8)
    assert closed_again(crank, made(crank, of_crank(TURN[0])[0]), np.where(DRIVE, of_crank(TURN[0] + 0.01)[0], 0.0)) == pytest.approx(
        of_crank(TURN[0] + 0.01)[0], abs=1e-9
    )
    slider = robot(SLIDERCRANK, drives=["S"])
    slide = np.array([[0.25, 0.26, 0.27], [0.3, 0.4, 0.3]])
    start = np.array([slider.close([0.5, -0.5, s], hold=["S"]).q for s in slide[:, 0]])
    targets = np.zeros((2, 3, 3))
    targets[..., 2] = slide
    q, found = closed_side_by_side(held_by(slider), targets, start)
    assert found.tolist() == [[True] * 3, [True, False, False]] and (q[1] == q[1, 0]).all() and q[0, :, 2] == pytest.approx(slide[0])
    with pytest.raises(NotClosed, match="with S = 0.4 m no closed position is found near that of the sample before") as e:
        followed(slider, closing.__class__(("S",), 0.0, 0.0), start, (targets, 0 * targets, 0 * targets))
    assert e.value.row == 1


def follower_of(model, samples=3, length=2.0, step=0.01):
    """The joints that follow in so many samples, of a mechanism of that length."""
    follower = Follower(model, step * np.arange(samples), np.zeros((samples, model.nq)), DRIVE, "motion", None)
    follower._length = length
    return follower


@pytest.mark.parametrize(("joint", "size", "jump"), [("B", 1, 0.2), ("S", 1, 0.4), ("S", -1, 0.4), ("A", 1, np.inf)])
@pytest.mark.parametrize("speed", [0.0, 7.0])
def test_steps_may_differ_from_rates_by_a_fifth(crank, joint, size, jump, speed):
    """Rad, or lengths of the mechanism, here of 2 m; and by as much more as the rates of this joint change in the step of 0.01 s."""
    follower, c = follower_of(crank), crank.joint_names.index(joint)
    allowed = min(jump, 9.0) + 2 * speed * 0.01
    v = np.zeros((3, 3))
    v[1:, c] = -speed, speed
    for share in (0.99, 1.01):
        q = np.zeros((3, 3))
        q[2, c] = size * share * allowed
        if share < 1 or np.isinf(jump):
            follower._check_branch(q, v)
            continue
        with pytest.raises(MotionError, match=rf"motion: sample 3 \(time 0\.02\): joint {joint}, which follows A, jumps to another branch"):
            follower._check_branch(q, v)


@pytest.mark.parametrize("bad", [0, 3, 6])
@pytest.mark.parametrize("kind", [ValueError, UserWarning])
def test_the_sample_is_named_at_which_rates_do_not_follow(crank, bad, kind):
    def rates(rows):
        if bad in range(7)[rows]:
            if kind is ValueError:
                raise ValueError
            warnings.warn("freedoms are left", UserWarning, stacklevel=1)
        return np.zeros((7, 3))[rows]

    q = np.column_stack([0.5 * np.arange(7), np.zeros((7, 2))])
    at = rf"motion: sample {bad + 1} \(time 0\.0{bad}\)" if bad else r"motion: sample 1 \(time 0\)"
    with pytest.raises(
        MotionError, match=rf"{at}: velocities of the other joints don't follow from those of A: with A = {0.5 * bad:g} rad the mechanism is at a singular"
    ):
        follower_of(crank, 7)._consistent(q, rates, "velocities")


@pytest.mark.parametrize("off", [1e-2, 1e-3, 1e-4, 3e-6, 0.0])
def test_near_a_dead_point_accelerations_are_those_of_the_closed_form_or_refused(robot, off):
    """The slider, driven, comes to `off` rad of crank and rod in one line and goes back."""
    swing = 0.2 * (1 + np.cos(np.pi * TIME)), -0.2 * np.pi * np.sin(np.pi * TIME), -0.2 * np.pi**2 * np.cos(np.pi * TIME)
    q, v, a = of_crank(np.arcsin(OFFSET / (CRANK + ROD)) + off + swing[0], *swing[1:])
    model = robot(SLIDERCRANK, drives=["S"])
    known = np.ones(3, dtype=bool)
    given = [[None, None], [None, None], [v[:, 2:], a[:, 2:]]]
    if off < 1e-5:
        with pytest.raises(
            MotionError,
            match=r"sample 20\d \(time [\d.]+\): positions and rates of the other joints don't follow from those of S: with S = 0\.349\d+ m the mechanism is at a singular",
        ):
            completed(model, TIME, q, given, known)
        return
    found = completed(model, TIME, q, given, known)
    assert np.abs(found.a - a).max() < 1e-11 / off**2 * np.abs(a).max()


@pytest.mark.parametrize(
    ("kind", "forces", "moments"),
    [("revolute", 3, 2), ("fixed", 3, 3), ("spherical", 3, 0), ("prismatic", 2, 3), ("cylindrical", 2, 2), ("planar", 1, 2), ("translation", 0, 3)],
)
def test_errors_of_angles_count_times_the_length(crank, kind, forces, moments):
    """Of equations of forces as they are, of those of moments times 2 m: the second of two loops, behind one of three forces and two moments."""
    follower, n = follower_of(crank), 5 + forces + moments
    loops = [SimpleNamespace(kind="revolute", equations=5), SimpleNamespace(kind=kind, equations=forces + moments)]
    follower._model = SimpleNamespace(loops=loops, loop_error=lambda q: -1e-3 * np.eye(n))
    assert follower._errors(np.zeros((n, 3))) == pytest.approx(1e-3 * np.array([1.0] * 3 + [2.0] * 2 + [1.0] * forces + [2.0] * moments))


@pytest.mark.parametrize(("share", "refused"), [(0.99, False), (1.01, True)])
def test_a_step_that_rates_do_not_explain_is_another_branch(crank, share, refused):
    """From 0.2 rad on; here of the rod, whose crank is moved between two samples by more than its speed, which is said to be zero."""
    steps = np.linspace(0, 0.5, 50_001)
    turned = of_crank(0.4 + steps)[0][:, 1] - of_crank(0.4)[0][1]
    q = of_crank(np.where(TIME < 1, 0.4, 0.4 + steps[np.searchsorted(-turned, 0.2 * share)]))[0]
    if not refused:
        assert made(crank, q, rates=(0 * q, 0 * q)).q == pytest.approx(q, abs=1e-9)
        return
    with pytest.raises(MotionError, match=r"motion: sample 201 \(time 1\): joint B, which follows A, jumps to another branch"):
        made(crank, q, rates=(0 * q, 0 * q))
    with pytest.raises(MotionError, match=r"motion: sample 2 \(time 1\): joint B"):
        made(crank, q[199:201], TIME[199:201], rates=(0 * q[:2], 0 * q[:2]))


def test_the_loop_that_stays_open_is_named(robot):
    """Of two, the second slider runs 0.9 m above the crank, of which crank and rod reach 0.35."""
    second = (
        link("rod2", 1.1, 0.12)
        + link("slider2", 0.9, 0.0)
        + joint("B2", "crank", "rod2", "0.1 0.03 0")
        + joint("S2", "frame", "slider2", "0 0.05 0.9", "prismatic", "1 0 0", SLIDE)
    )
    model = robot(SLIDERCRANK.replace("</robot>", second + loop("C2", "rod2", "0.25 0.03 0", "slider2", "0 0.01 0") + "</robot>"), drives=["A"])
    with pytest.raises(MotionError, match=r"from its neutral position no closed position was found: loop joint C2 stays open by 0\.\d"):
        held_by(model)


def test_a_motion_that_leaves_the_reach_names_sample_and_time(robot):
    model = robot(SLIDERCRANK, drives=["S"])
    apart = np.hypot(0.3495, OFFSET) - CRANK - ROD  # at the first of the eight steps there that fails, of 0.125 mm
    with pytest.raises(
        MotionError, match=rf"sample 51 \(time 0\.25\): with S = 0\.35 m no closed position was found: loop joint C stays open by {apart:.3g} m"
    ):
        made(model, np.column_stack([0 * TIME, 0 * TIME, 0.3 + 0.2 * TIME]), known=(False, False, True))


def test_made_motions_name_joint_limit_and_time(robot):
    """Of drives that go beyond their limits between waypoints, and where no closed position is found."""
    model = robot(SLIDERCRANK, drives=["S"])
    beyond = Waypoints(np.array([[0.25], [0.3], [0.9]]))
    with pytest.raises(
        MotionError, match=r"minjerk: between waypoints 2 and 3, at 53\.5 % of the time, S goes to 1\.088\d* m, beyond its upper limit 1 m; add waypoints"
    ):
        minimum_jerk(model, beyond)
    with pytest.raises(MotionError, match=r"between waypoints 2 and 3, at 1\.07 s, S goes to 1\.088\d* m, beyond its upper limit 1 m"):
        minimum_jerk(model, beyond, duration=2.0)
    reach = r"at 0\.99\d+ s: with S = 0\.3\d+ m no closed position was found: loop joint C stays open .*; the limits allow S from 0 to 1 m, which may be more than can be reached"
    with pytest.raises(MotionError, match=r"trapezoid: between waypoints 1 and 2, " + reach):
        trapezoid(model, Waypoints(np.array([[0.3], [0.4]])), duration=2.0)
    crank = robot(FOURBAR, drives=["A"])
    with pytest.raises(
        MotionError, match=r"minjerk: in 0\.5 s the speed of A would be 2\.36 of its limit 10 rad/s, at 0\.25 s; the shortest time within all limits is"
    ):
        minimum_jerk(crank, Waypoints(np.array([[0.0], [2 * np.pi]])), duration=0.5)
    whole = minimum_jerk(crank, Waypoints(np.array([[0.0], [2 * np.pi]])))  # a crank without limits goes where it is sent
    assert whole.motion.q[-1, 0] == pytest.approx(2 * np.pi) and "the file gives no limits of position for A: they go where the waypoints are" in whole.notes
    weak = robot(FOURBAR.replace('effort="5" velocity="10"', 'effort="4" velocity="100"'), drives=["A"])
    with pytest.raises(
        MotionError, match=r"in 0\.4 s the effort of A would be 1\.9\d* of its limit 4 N m, at 0\.\d+ s; the shortest time within all limits is 0\.598"
    ):
        minimum_jerk(weak, Waypoints(np.array([[0.0], [2 * np.pi]])), duration=0.4)
    limit = '<limit lower="-4" upper="-1.6" effort="1" velocity="1"/>'
    limited = FOURBAR.replace('<joint name="D" type="continuous">', '<joint name="D" type="revolute">')
    limited = limited.replace('<origin xyz="0.35 0.04 0.04"/><axis xyz="0 -1 0"/>', f'<origin xyz="0.35 0.04 0.04"/><axis xyz="0 -1 0"/>{limit}')
    follows = robot(limited, drives=["A"])
    made = minimum_jerk(follows, Waypoints(np.array([[0.0], [2 * np.pi]])))
    lines = beyond_limits(follows, made.motion)
    assert any(re.match(r"D follows to \S+ rad at sample \d+ \(time \S+\), beyond its upper limit -1.6 rad; narrow the waypoints", line) for line in lines), (
        lines
    )
    assert any(re.match(r"D follows at \S+ rad/s at sample \d+ \(time \S+\), beyond its limit 1 rad/s", line) for line in lines), lines
    assert not any("lower limit" in line for line in lines)
    low = beyond_limits(follows, replace(made.motion, q=made.motion.q - 5))
    assert any("beyond its lower limit -4 rad" in line for line in low) and not any("upper" in line for line in low)
    fast = beyond_limits(follows, replace(made.motion, v=100 * made.motion.v))
    assert fast and all(line.startswith("D follows") for line in fast), "what leads is kept within its limits elsewhere"


def test_files_need_the_columns_of_drives_and_of_what_floats(robot, written, refusal):
    """Or constants in their place; nobody else's, unless drives aren't known."""
    model = robot(FOURBAR, drives=["A"])
    lines = lambda *names: written(",".join(["time", *names]) + "".join(f"\n{0.1 * k}" + f",{0.01 * k}" * len(names) for k in range(9)))
    assert read_motion(model, lines("A")).closing.held == ("A",)
    assert refusal(model, lines("B")).endswith("no column 'A' for joint A; add its positions (rad) at every sample")
    constant = written("[constants]\nA = 0.5\n", "map.toml")
    assert (read_motion(model, lines("B"), map=constant).q[:, 0] == 0.5).all()
    unknown = robot(FOURBAR)
    said = refusal(unknown, lines("A"))
    assert (
        "no column 'B' for joint B. The columns of the joints that have motors would do, but fourbar doesn't say which these are; name them: --drives" in said
    )
    assert "no column 'A' for joint A. " in refusal(unknown, lines("B")) and "no column 'B' for joint B. " in refusal(unknown, lines("D"), map=constant)
    flying = robot(FOURBAR, drives=["A"], floating_base=True)
    assert "no column 'floating_base.x' for joint floating_base; add its pose" in refusal(flying, lines("A"))


def test_velocities_of_joints_that_follow_are_compared(robot, written):
    """As positions are: those of the file that are other ones are doubted, and not used."""
    model = robot(FOURBAR, drives=["A"])
    at = [0.1 * k for k in range(9)]
    right = read_motion(model, written("time,A" + "".join(f"\n{t},{t * t}" for t in at)))
    table = lambda factor: written("time,A,D.v" + "".join(f"\n{t},{t * t},{factor * v}" for t, v in zip(at, right.v[:, 2], strict=True)))
    assert read_motion(model, table(1.04)).contradictions == []
    wrong = read_motion(model, table(-1.0))
    assert len(wrong.contradictions) == 1 and "D.v at " in wrong.contradictions[0] and "but the joint follows at " in wrong.contradictions[0]
    assert wrong.v == pytest.approx(right.v, abs=1e-12)


def test_a_link_that_floats_in_the_file_follows_where_loops_tie_it_down(robot, written):
    """Platforms of parallel robots are often written so."""
    apart, linked = robot(FREE_COUPLER, drives=["A"]), robot(FOURBAR, drives=["A"])
    assert [j.name for j in leading(apart)] == ["A"]
    table = written("time,A" + "".join(f"\n{0.1 * k},{0.02 * k * k}" for k in range(9)))
    (a, b) = (read_motion(m, table) for m in (apart, linked))
    assert a.q[:, apart.joint("D").q_index] == pytest.approx(b.q[:, 2], abs=1e-9)
    efforts = [m.inverse_dynamics(x.q, x.v, x.a)[:, m.joint("A").v_index] for m, x in ((apart, a), (linked, b))]
    assert efforts[0] == pytest.approx(efforts[1], rel=1e-9)
    flying = robot(FOURBAR, drives=["A"], floating_base=True)
    assert [j.name for j in leading(flying)] == ["floating_base", "A"], "no loop ties the base to the ground"


def test_columns_of_as_many_drives_as_freedoms_are_enough(robot, written, refusal):
    """Whichever they are: a second motor on the mechanism asks for no second column."""
    model = robot(FOURBAR, drives=["A", "D"])
    lines = lambda name, first=0.0: written(f"time,{name}" + "".join(f"\n{0.1 * k},{first + 0.01 * k}" for k in range(9)))
    for name, first, follow in (("A", 0.0, [1, 2]), ("D", -1.75, [0, 1])):
        assert read_motion(model, lines(name, first)).closing.held == (name,) and follow_by_loops(model, [name]).tolist() == follow
    assert "no column 'A' for joint A" in refusal(model, lines("B"))


def test_angles_of_joints_with_several_coordinates_are_no_lengths(robot):
    """Positions of a ball joint that are off by 0.008 rad are told and not doubted, in a mechanism of 0.4 m as in one of 4 m."""
    ball = '<joint name="B" type="spherical"><parent link="crank"/><child link="coupler"/><origin xyz="0.1 0.03 0"/></joint>'
    model = robot(re.sub('<joint name="B".*?</joint>', ball, FOURBAR), drives=["A"])
    q = completed(model, TIME, np.zeros((len(TIME), model.nq)), [[None, None]] * 3, np.arange(model.nq) == 0).q
    turned = model.integrate(q, np.broadcast_to([0, 0.008, 0, 0, 0], (len(q), model.nv)))
    found = completed(model, TIME, turned, [[None, None]] * 3, np.arange(model.nq) < 5)
    assert found.contradictions == []
    assert "positions of B in the motion differ from those that follow by up to 0.008 rad, at 0 s" in found.closing.compared
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # quaternions of three decimals have no unit length
        found = completed(model, TIME, np.hstack([q[:, :1], np.round(q[:, 1:], 3)]), [[None, None]] * 3, np.arange(model.nq) < 5)
    assert "positions of B in the motion" in str(found.closing.compared)


def test_long_lists_of_names():
    assert [_some(list("abcdefgh"[:n])) for n in (1, 6, 7)] == ["a", "a, b, c, d, e, f", "a, b, c, d, e, f and 1 more"]
