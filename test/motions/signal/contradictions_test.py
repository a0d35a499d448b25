"""Rates that contradict positions, and jumps that are said: how much is a doubt, and what its sentence names."""

import numpy as np
import pytest

from chains import SLIDE
from ksl.base.errors import MotionError
from ksl.mechanism.mechanism import Joint
from ksl.motions.motion import complete
from ksl.motions.signal.corners import Found, Jumps
from ksl.motions.signal.quality import sentences_about_jumps


@pytest.mark.parametrize("given", [[None, None], ["v", None], [None, "a"]])
def test_six_samples_are_needed_to_differentiate(leg, given):
    rates = [None if x is None else np.zeros((5, 1)) for x in given]
    with pytest.raises(MotionError, match="5 samples, but differentiating hip needs at least 6; add samples, or give the columns hip.v and hip.a"):
        complete(leg, np.arange(5.0), np.zeros((5, 2)), [rates, [np.zeros((5, 1))] * 2])
    rates = [None if x is None else np.zeros((6, 1)) for x in given]
    assert not complete(leg, np.arange(6.0), np.zeros((6, 2)), [rates, [np.zeros((6, 1))] * 2]).v.any()
    assert complete(leg, np.arange(2.0), np.zeros((2, 2)), [[np.zeros((2, 1))] * 2] * 2).q.shape == (2, 2)


@pytest.mark.parametrize(("more", "said"), [(0.052, False), (0.0533, True), (-0.0495, False), (-0.0505, True)])
def test_rates_that_differ_by_a_twentieth_contradict(leg, more, said):
    """Of the larger of both, at a steady speed of 2 rad/s."""
    t = np.arange(40) * 0.1
    q, v, none = np.column_stack([2 * t, 0 * t]), np.full((40, 1), 2 * (1 + more)), np.zeros((40, 1))
    found = complete(leg, t, q, [[v, none], [none, none]]).contradictions
    assert [line.startswith("hip.v at ") and f"is {2 * (1 + more):.4g} rad/s, but the position of hip changes at 2 rad/s" in line for line in found] == [
        True
    ] * said


@pytest.mark.parametrize(("speed", "most"), [(0.04, 1e-5), (5.0, 5e-5)])
def test_a_contradiction_needs_a_way(leg, speed, most):
    """An integral of more than 1e-5 of the largest position or rate, or of 1."""
    t = np.arange(24) * 0.1
    for share, said in ((0.95, False), (1.05, True)):
        v = np.zeros((24, 1)) + share * most / 0.6
        none = np.zeros((24, 1))
        q = np.column_stack([speed * np.ones(24), 0 * t])
        lines = complete(leg, t, q, [[v, none], [none, none]]).contradictions
        assert [line.startswith("hip.v at ") for line in lines] == [True] * said


@pytest.mark.parametrize(("apart", "times"), [(0.19, 1), (0.21, 2)])
def test_corners_within_a_fifth_of_a_step_are_one(apart, times):
    found = {name: Found(Jumps(2, np.array([t]), np.ones(1))) for name, t in (("hip", 0.5), ("slide", 0.5 + 0.1 * apart))}
    notes, at, doubts = sentences_about_jumps((SLIDE,), found, {}, 0.1 * np.arange(9))
    assert len(at) == times and at[0] == 0.5 and doubts == []
    assert notes[0].startswith(f"accelerations of hip and 1 more jump {'once' if times == 1 else '2 times, first'} at 0.5 s")


@pytest.mark.parametrize(("size", "turn"), [(2 * np.pi * 1.0099, True), (-2 * np.pi * 0.9901, True), (2 * np.pi * 1.0101, False), (2 * np.pi * 0.9899, False)])
def test_a_full_turn_is_one_to_a_hundredth(size, turn):
    hip = Joint("hip", "revolute", "a", "b", 1, 1, 0, 0, (0.0, 0.0, 1.0), has_axis=True, has_angle=True)
    for joint in (hip, SLIDE):
        found = {joint.name: Found(Jumps(2, np.empty(0), np.empty(0)), [(0, 0.5, size), (0, 0.9, size)])}
        assert " at 0.5 s (2 such jumps)" in sentences_about_jumps((joint,), found, {}, 0.1 * np.arange(9))[2][0]
        found = {joint.name: Found(Jumps(2, np.empty(0), np.empty(0)), [(0, 0.5, size)])}
        (said,) = sentences_about_jumps((joint,), found, {}, 0.1 * np.arange(9))[2]
        assert (
            said.startswith(f"{joint.name} jumps by {size:.4g} at 0.5 s") and "such" not in said and ("a full turn. Unwrap" in said) == (turn and joint is hip)
        )


def test_where_rates_contradict_most(leg):
    """A tenth more in the second half, and most at 6.3 s; faults of one kind are counted."""
    t = np.arange(80) * 0.1
    v, none = np.where(t > 4, 2.2, 2.0) + 0.1 * (np.arange(80) == 63), np.zeros((80, 1))
    said, *_ = complete(leg, t, np.column_stack([2 * t, 0 * t]), [[v[:, None], none], [none, none]]).contradictions
    assert said.startswith("hip.v at 6.3 s is 2.3 rad/s, but the position of hip changes at 2 rad/s")
    for many, often in ((1, ""), (2, " (2 such samples)")):
        found = {"slide": Found(Jumps(2, np.empty(0), np.empty(0)), [(-1, 0.5 + k, 0.25) for k in range(many)])}
        assert sentences_about_jumps((SLIDE,), found, {}, t)[2][0].startswith(f"the sample of slide at 0.5 s is 0.25 off those around it{often}: efforts")
        found = {"slide": Found(Jumps(2, np.empty(0), np.empty(0)), [(1, 0.5 + k, 0.25) for k in range(many)])}
        assert sentences_about_jumps((SLIDE,), found, {}, t)[2][0].startswith(
            f"the rate of slide jumps by 0.25 at 0.5 s{often.replace('samples', 'jumps')}, which"
        )
    for many, often in ((1, ""), (2, " (2 such jumps)")):
        found = {"slide": Found(Jumps(2, np.empty(0), np.empty(0)), [(0, 0.5 + k, 0.25) for k in range(many)])}
        assert sentences_about_jumps((SLIDE,), found, {}, t)[2][0].startswith(f"slide jumps by 0.25 at 0.5 s{often}, which no force can do")
