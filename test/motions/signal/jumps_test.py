"""ksl.motions.signal.corners: what is a jump of an acceleration and what is none, each just below and just above, and polynomials beside jumps."""

import numpy as np
import pytest

from ksl.motions.signal.corners import Found, Jumps, evenly_spaced, find_jumps, jumps_at, noise_of_jumps, normalised_differences, one_sided
from ksl.motions.signal.quality import _all_jumps


def test_noise_of_extrapolations_in_closed_form():
    """Through one, two and three samples at 1/2, 3/2, 5/2 on each side, from there to the middle."""
    assert noise_of_jumps(1) == pytest.approx([np.sqrt(2)])
    assert noise_of_jumps(2) == pytest.approx([np.sqrt(2 * (9 + 1) / 4), 2])
    assert noise_of_jumps(3) == pytest.approx([np.sqrt(2 * (225 + 100 + 9)) / 8, np.sqrt(2 * (4 + 9 + 1)), np.sqrt(2 * (1 + 4 + 1))])


def test_jumps_of_a_curve_and_of_its_slope_add_up():
    time = np.linspace(0, 4, 41)
    found = Found(Jumps(2, np.array([3.0]), np.array([4.0])), [(0, 1.0, 2.0), (1, 2.0, 3.0)])
    expected = 2 * (time >= 1) + 3 * np.maximum(time - 2, 0) + 2 * np.maximum(time - 3, 0) ** 2
    assert _all_jumps(found, time) == pytest.approx(expected, abs=1e-12)


def corner(at=0.503, off=0.0, left=0.0, right=0.0, step=0.01):
    """A motion whose acceleration jumps by 2 rad/s² at `at`, and its position by `off`; jerks on both sides."""
    t = step * np.arange(101)
    u = t - at
    return t, 0.2 * t + 0.3 * t**2 + np.where(u > 0, off + u**2 + right * u**3 / 6, left * u**3 / 6)


@pytest.mark.parametrize(
    ("most", "how"),
    [
        (0.03 * 2e-4, {"off": 1.0}), (0.2 / (0.015 - 0.0002), {"right": 1.0}), (0.2 / (0.015 + 0.0002), {"right": -1.0}),
        (0.2 / (0.01 - 0.0004), {"left": -1.0, "right": 1.0}),
    ],
    ids=str,
)  # fmt: skip
def test_what_is_a_jump_of_acceleration(most, how):
    """The sides meet to 3 % of J h².  Quadratics and cubics, 1.5 steps apart, agree to 10 % of J, which is taken 0.2 steps behind the jump; and
    within a step the acceleration of either side changes by less than that: where the jerks are opposite, both curves agree."""
    for share, found in ((0, True), (0.99, True), (1.02, False)):
        t, x = corner(**{name: share * most * sign for name, sign in how.items()})
        (one,) = find_jumps(t, x[:, None])
        assert (len(one.jumps.times) == 1) == found
        if share == 0:
            assert one.jumps.times == pytest.approx([0.503], abs=1e-9) and one.jumps.sizes == pytest.approx([2.0])


def test_a_jump_needs_five_samples_on_each_side():
    for n in range(2, 16):
        t = np.arange(float(n))
        (one,) = find_jumps(t, np.maximum(t - n / 2 + 0.4, 0)[:, None] ** 2)
        assert len(one.jumps.times) == (n >= 10) and not one.impossible


@pytest.mark.parametrize(("second", "count"), [(0.0197, 1), (0.0203, 2)])
def test_small_jumps_beside_large_ones_do_not_matter(second, count):
    """Less than 2 % of the largest acceleration; here 1 rad/s² after the first jump."""
    t = 0.01 * np.arange(201)
    x = np.maximum(t - 0.503, 0) ** 2 / 2 - second * np.maximum(t - 1.504, 0) ** 2 / 2
    (one,) = find_jumps(t, x[:, None])
    assert len(one.jumps.times) == count and one.impossible == []


@pytest.mark.parametrize(("at", "snapped"), [(0.500009, 0.5), (0.500011, 0.500011), (0.499991, 0.5), (0.499989, 0.499989)])
def test_times_beside_samples(at, snapped):
    """A thousandth of the step from a sample is at the sample."""
    t, x = corner(at=at)
    (one,) = find_jumps(t, x[:, None])
    assert one.jumps.times == pytest.approx([snapped], abs=1e-8)


@pytest.mark.parametrize("order", [2, 1])
@pytest.mark.parametrize("rows", [slice(None), slice(None, None, -1)])
def test_slow_motions_that_were_rounded_jump(order, rows):
    """By a step of rounding; by more than three also numbers that are multiples of one."""
    k = np.arange(101)
    for steps in (2, 2.99, 3.01):
        (one,) = find_jumps(0.01 * k, (1e-3 * (k + steps * (k > 50)))[rows, None], order, np.array([1e-3]))
        assert [f[0] for f in one.impossible] == [0] * (steps > 3) and len(one.jumps.times) == 0


@pytest.mark.parametrize("order", [2, 1])
def test_jumps_that_are_impossible_have_time_and_size(order):
    t = 0.01 * np.arange(101)
    smooth = np.sin(t)
    spike = smooth + 0.01 * (np.arange(101) == 40)
    (one,) = find_jumps(t, spike[:, None], order)
    ((kind, time, size),) = one.impossible
    assert (kind, time) == (-1, pytest.approx(0.4)) and size == pytest.approx(0.01, rel=1e-3) and len(one.jumps.times) == 0
    (one,) = find_jumps(t, (smooth + 0.5 * (t > 0.605))[:, None], order)
    assert [(k, pytest.approx(time, abs=0.006), pytest.approx(size, rel=1e-2)) for k, time, size in one.impossible] == [(0, 0.605, 0.5)]
    if order == 2:
        (one,) = find_jumps(t, (smooth + 3 * np.maximum(t - 0.603, 0))[:, None], order)
        assert [(k, pytest.approx(time, abs=1e-3), pytest.approx(size, rel=1e-2)) for k, time, size in one.impossible] == [(1, 0.603, 3.0)]


def test_jumps_of_long_motions_that_were_rounded():
    """Of these not each difference is looked at to tell whether they were."""
    t = 0.01 * np.arange(9001)
    x = np.round(np.sin(0.3 * t), 4) + 1e-12 * np.arange(9001)
    jump = np.where(t > 45.003, (t - 45.003) ** 2, 0)
    for step, count in ((0.0, 0), (1e-4, 0)):
        assert [len(f.jumps.times) for f in find_jumps(t, x[:, None], 2, np.array([step]))] == [count]
    (one,) = find_jumps(t, (np.sin(0.3 * t) + jump)[:, None], 2, np.array([1e-9]))
    assert one.jumps.times == pytest.approx([45.003], abs=1e-5) and one.jumps.sizes == pytest.approx([2.0], rel=1e-3)


def test_even_steps():
    """To a thousandth of the mean: the last of three steps is longer by e, and so 2 e / 3 longer than the mean."""
    e = 1e-3 / (2 / 3 - 1e-3 / 3)
    assert [evenly_spaced(np.array([0.0, 1, 2, 3 + x])) for x in (0.999 * e, 1.001 * e, -1.001e-3 / (2 / 3 + 1e-3 / 3))] == [True, False, False]


@pytest.mark.parametrize("even", [True, False])
@pytest.mark.parametrize("order", [1, 4, 8])
def test_differences_leave_nothing_of_polynomials_and_all_of_noise(order, even):
    """The squares of the weights, which unit impulses show, have the sum 1."""
    t = np.arange(24.0) if even else np.cumsum(np.random.default_rng(order).uniform(0.5, 2, 24))
    assert normalised_differences(t, (t[:, None] / 10) ** np.arange(order), order) == pytest.approx(0, abs=1e-6)
    weights = normalised_differences(t, np.eye(24), order)
    assert weights.shape == (24 - order, 24) and (weights**2).sum(axis=1) == pytest.approx(1)
    assert all(np.flatnonzero(row).tolist() == list(range(k, k + order + 1)) for k, row in enumerate(weights))
    steps = np.round(t * 2**20) / 2**20
    for other in (steps + 2.0**30, steps * 2.0**-60):  # from another time on, and in another unit
        assert normalised_differences(other, np.eye(24), order) == pytest.approx(weights, abs=1e-5)


def test_polynomials_on_one_side():
    rng = np.random.default_rng(3)
    t, c = np.cumsum(rng.uniform(0.5, 2, 30)), rng.normal(size=4)
    p = np.polynomial.Polynomial(c)
    at, first = np.array([2.5, 9.1, 20.0]), np.array([0, 7, 22])
    found = one_sided(t, p(t), first, 4, at)
    assert found == pytest.approx(np.column_stack([p.deriv(k)(at) if k else p(at) for k in range(4)]), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("at", [0.5, 0.503])
def test_jumps_at_known_times(at):
    """Of both derivatives, exactly for quartics; with fewer than three samples to the next jump there is none."""
    t = 0.01 * np.arange(101)
    x = t**4 - t**2 + np.where(t > at, 0.7 * (t - at) - 1.5 * (t - at) ** 2, 0)
    first, second = jumps_at(t, x, np.array([at, 0.99]))
    assert first.sizes == pytest.approx([0.7, 0], abs=1e-7) and second.sizes == pytest.approx([-3, 0], abs=1e-4) and (first.order, second.order) == (1, 2)
    assert [j.sizes.tolist() for j in jumps_at(t, x, np.array([1.7]))] == [[0], [0]], "behind the last sample"
    close = jumps_at(t, np.maximum(t - 0.5, 0), np.array([0.5, 0.515]))[0]
    assert close.sizes[0] == 0 and jumps_at(t, np.maximum(t - 0.5, 0), np.array([0.5, 0.525]))[0].sizes == pytest.approx([1, 0])


@pytest.mark.parametrize("rows", [slice(None), slice(None, None, -1)])
@pytest.mark.parametrize(("off", "said"), [(0.0149, False), (0.0151, True), (-0.0151, True)])
def test_an_end_that_is_off_by_more_than_one_and_a_half_steps(off, said, rows):
    t = np.arange(40) * 0.1
    x = (0.1 * t + off * (np.arange(40) == 0))[rows]
    (one,) = find_jumps(t, x[:, None])
    ends = [(-1, pytest.approx(0.0 if rows == slice(None) else 3.9), pytest.approx(off))] if said else []
    assert one.impossible == ends
    (one,) = find_jumps(t, (x[rows] - 0.025 * np.maximum(t - 2.03, 0) ** 2)[rows, None])  # with a corner inside
    assert one.impossible == ends and len(one.jumps.times) == 1
