"""ksl.motions.signal.corners: sums of jumps, polynomials beside them, and differences.  What is a jump and what is none: corners_by_hand_test.py."""

import numpy as np
import pytest

from ksl.motions.signal.corners import Found, Jumps, evenly_spaced, find_jumps, jumps_at, normalised_differences, one_sided
from ksl.motions.signal.quality import _all_jumps


def test_jumps_of_a_curve_and_of_its_slope_add_up():
    time = np.linspace(0, 4, 41)
    found = Found(Jumps(2, np.array([3.0]), np.array([4.0])), [(0, 1.0, 2.0), (1, 2.0, 3.0)])
    expected = 2 * (time >= 1) + 3 * np.maximum(time - 2, 0) + 2 * np.maximum(time - 3, 0) ** 2
    assert _all_jumps(found, time) == pytest.approx(expected, abs=1e-12)


def test_a_jump_needs_five_samples_on_each_side():
    for n in range(2, 16):
        t = np.arange(float(n))
        (one,) = find_jumps(t, np.maximum(t - n / 2 + 0.4, 0)[:, None] ** 2)
        assert len(one.jumps.times) == (n >= 10) and not one.impossible


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
