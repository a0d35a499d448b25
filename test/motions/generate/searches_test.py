"""Chirps in closed form, and the search for an excitation: limits that each candidate keeps, and when it ends."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from chains import limit, robot_of
from ksl.base.errors import MotionError
from ksl.motions.generate import chirp, excitation
from ksl.motions.generate.excitation import Series, _Search
from ksl.motions.generate.generated import limits_of, worst_use


@pytest.mark.parametrize("effort", [0.2, 1.0])
def test_an_excitation_beyond_efforts_is_slowed_down(robot, effort):
    """As a whole: its rates stay its derivatives, its samples the same, and the effort that is used most is at 80 %."""
    m = robot_of(robot, ("a", "revolute", limit(-1, 2, 3, effort)), ("b", "revolute", limit(-0.5, 0.5, 2, 100)))
    made = excitation(m, iterations=3, rate=100.0)
    t, q, v, a = made.motion.time, made.motion.q, made.motion.v, made.motion.a
    assert made.facts["period"] == t[-1] > 10 and made.facts["rate"] * t[-1] == pytest.approx(1000) and len(t) == 1001
    assert CubicSpline(t, q)(t, 1) == pytest.approx(v, abs=1e-5 * np.abs(v).max()) and CubicSpline(t, v)(t, 1) == pytest.approx(a, abs=1e-4 * np.abs(a).max())
    assert np.abs(m.inverse_dynamics(q, v, a))[:, 0].max() == pytest.approx(0.8 * effort)


@pytest.mark.parametrize(("root", "condition"), [(1e-6, 1e6), (0.95e-7, 1e7), (1.05e-7, 1 / 1.05e-7), (0.0, 1e7)])
def test_condition_numbers_end_where_motions_excite_nothing(robot, root, condition):
    m = robot_of(robot, ("a", "revolute", limit(-1, 2, 3, 1e9)))
    limits = limits_of(m)
    base = type("Base", (), {"links": None, "__len__": lambda self: 2, "regressor": lambda self, full: np.diag([1.0, root])})()
    search = _Search(m, limits, base, Series(limits, 5.0), 0)
    assert search._cost(np.random.default_rng(0).normal(size=12)) == pytest.approx(condition, rel=1e-6)


def test_a_chirp_in_closed_form(robot):
    """Phase 2π (low t + (high − low) t² / 2T), the second joint 7 % faster; quintic ends of a twentieth of the time."""
    m = robot_of(robot, ("a", "revolute", limit(-1, 2, 3, 1e6)), ("b", "revolute", limit(-0.5, 0.5, 1, 1e6)))
    made = chirp(m, duration=10.0, low=0.2, high=1.5, rate=100.0, acceleration=20.0)
    t = np.linspace(0, 10, 1001)[:, None]
    faster = np.array([1.0, 1.07])
    w = 2 * np.pi * (0.2 + 0.13 * t) * faster
    x = np.clip(np.minimum(t, 10 - t) / 0.5, 0, 1)
    amplitude = ((1 / np.array([1.5, 0.5])) ** 4 + (w / np.array([3.0, 1.0])) ** 4 + (w**2 / 20) ** 4) ** -0.25
    expected = np.array([0.5, 0]) + made.facts["share"] * (10 * x**3 - 15 * x**4 + 6 * x**5) * amplitude * np.sin(2 * np.pi * (0.2 * t + 0.065 * t**2) * faster)
    assert made.motion.q == pytest.approx(expected, abs=1e-9)
    assert worst_use(limits_of(m, 20.0), made.motion.q, made.motion.v, made.motion.a).share == pytest.approx(0.8, rel=0.06) and made.facts["share"] <= 0.8
    for low, high in ((0.0, 1.0), (1.0, 1.0), (1.0, 10.0)):
        with pytest.raises(MotionError, match="chirp from"):
            chirp(m, low=low, high=high, rate=100.0)


def test_a_chirp_within_efforts(robot):
    """Amplitudes are reduced by a twentieth at a time, forty times at most.  About the vertical, efforts are in proportion to them."""
    of = lambda effort: robot_of(robot, ("a", "revolute", limit(-1, 1, 1e3, effort)))
    plain = chirp(of(1e9), duration=10.0, rate=100.0)
    assert plain.facts["share"] == 0.8
    peak = np.abs(of(1e9).inverse_dynamics(plain.motion.q, plain.motion.v, plain.motion.a)).max() / 0.8
    for times in (0.0, 1.0, 7.0, 39.0):
        assert chirp(of(peak * 0.95 ** (times - 0.01)), duration=10.0, rate=100.0).facts["share"] == pytest.approx(0.8 * 0.95**times)
    with pytest.raises(MotionError, match="efforts are beyond their limits even at small amplitudes"):
        chirp(of(peak * 0.95**39.01), duration=10.0, rate=100.0)


@pytest.mark.parametrize("seed", range(3))
def test_any_candidate_of_a_search_keeps_to_the_limits(robot, seed):
    """A share s of one of them is used: 90 % of the range, and 78.8 % of the speed; it begins at rest, and its rates are its derivatives."""
    m = robot_of(robot, ("a", "revolute", limit(-1, 2, 3)), ("b", "revolute", limit(-0.5, 0.5, 0.3)))
    limits = limits_of(m, 5.0)
    series, x = Series(limits, 7.0), np.random.default_rng(seed).normal(size=24) * 2
    q, v, a = series(x, series.times)
    assert series.times == pytest.approx(np.arange(100) * (7.0 / 5 / 20)), "twenty in the shortest period"
    used = np.maximum.reduce(
        [np.ptp(q, axis=0) / (2 * 0.9 * limits.half), np.abs(v).max(axis=0) / (0.985 * 0.8 * limits.velocity), np.abs(a).max(axis=0) / (0.985 * 5)]
    )
    share = 1 / (1 + np.exp(-3 - x.reshape(2, 12)[:, -2]))
    assert used == pytest.approx(share) and (q >= limits.middle - 0.9 * limits.half - 1e-12).all() and (q <= limits.middle + 0.9 * limits.half + 1e-12).all()
    t, h = np.linspace(0, 14, 200), 1e-5
    (q0, v0, _), (q1, v1, _), (_, vt, at) = series(x, t - h), series(x, t + h), series(x, t)
    assert (q1 - q0) / (2 * h) == pytest.approx(vt, abs=1e-6) and (v1 - v0) / (2 * h) == pytest.approx(at, abs=1e-6)
    assert vt[0] == pytest.approx(0, abs=1e-12) and at[0] == pytest.approx(0, abs=1e-12) and vt[-1] == pytest.approx(0, abs=1e-10)
    room = limits.middle + (0.9 * limits.half - np.ptp(q, axis=0) / 2) * np.tanh(x.reshape(2, 12)[:, -1])
    assert (q.max(axis=0) + q.min(axis=0)) / 2 == pytest.approx(room)


@pytest.mark.parametrize(("iterations", "reason"), [(41, "improving"), (4, "improving")])
def test_a_search_that_has_just_begun_is_not_at_its_end(robot, iterations, reason):
    m = robot_of(robot, ("a", "revolute", limit(-1, 2, 3)), ("b", "revolute", limit(-0.5, 0.5, 2)))
    facts = excitation(m, iterations=iterations, rate=20.0).facts
    assert facts["iterations"] == iterations and facts["reason"] in (reason, "converged") and facts["condition"] <= facts["first"]
    assert (facts["condition"] == facts["first"]) or iterations > 40


@pytest.mark.parametrize(
    ("tried", "gain", "smallest", "reason"),
    [
        (100, 0.0099, 50.0, "converged"), (100, 0.0101, 50.0, "improving"), (41, 0.0, 50.0, "converged"), (40, 0.0, 50.0, "improving"), (100, 0.0, 1.001e7, "singular"),
        (100, 0.0, 0.999e7, "converged"), (3, 1.0, 50.0, "improving"),
    ],
)  # fmt: skip
def test_when_a_search_is_at_its_end(tried, gain, smallest, reason):
    """The number fell by less than a hundredth in the last quarter; forty random candidates are no search, and 1e7 is no number."""
    search = object.__new__(_Search)
    search.tried, search.smallest = tried, smallest
    search._after = [smallest / (1 - gain) * (1 + abs(k - (3 * tried // 4 - 1))) if tried > 3 else smallest for k in range(tried)]
    assert search.progress() == {"gain": pytest.approx(gain), "converged": reason == "converged", "reason": reason}
