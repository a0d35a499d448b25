"""Angles modulo a turn, against 200 bits; the errata B13 and B14 of the published library."""

import gmpy2
import numpy as np
import pytest

from reference import UNIT, mp

N = 10_000
F = pytest.mark.parametrize("f, scalar", [("", "double"), ("f", "float")])
DTYPE = {"double": np.float64, "float": np.float32}
PI = gmpy2.const_pi()
sin, cos = np.frompyfunc(gmpy2.sin, 1, 1), np.frompyfunc(gmpy2.cos, 1, 1)
atan2, floor = np.frompyfunc(gmpy2.atan2, 2, 1), np.frompyfunc(gmpy2.floor, 1, 1)


def ulp(x, scalar):
    return np.spacing(abs(x.astype(float)).astype(DTYPE[scalar])).astype(float)


def angles(random, scalar, turn):
    x = np.concatenate(
        [
            random.uniform(-3 * turn, 3 * turn, N),
            random.choice([-1, 1], N) * 10.0 ** random.uniform(-30, 7, N),
            turn * np.arange(-50, 51),
            [0.0, -0.0, -1e-17, 1e-17, np.nextafter(turn, 0), turn],
        ]
    )
    return x.astype(DTYPE[scalar])


@F
@pytest.mark.parametrize("name, turn", [("Degrees", gmpy2.mpfr(360)), ("Radians", 2 * PI)])
def test_normalize(ksl, f, scalar, name, turn, record_property):
    x = angles(np.random.default_rng(1), scalar, float(turn))
    got, _ = ksl(f"ksl_normalize{name}{f}", x)
    assert (got >= 0).all() and (got.astype(float) < float(turn)).all() and not np.signbit(got).any()
    exact = mp(x) - floor(mp(x) / turn) * turn
    error = abs((mp(got) - exact).astype(float))
    error = np.minimum(error, abs(error - float(turn)))  # what rounds to a turn is 0
    allowed = ulp(exact, scalar) + UNIT[scalar] ** 2 * abs(x.astype(float))
    worst = (error / allowed).max()
    record_property("worst_ulp", float(worst))
    assert worst <= 1.5


@F
def test_normalize_of_huge_and_not_finite(ksl, f, scalar):
    huge = np.array([1e18, -1e18, 1e30, -1e38] + ([1e300, -1e300] if scalar == "double" else []), DTYPE[scalar])
    for name, turn in (("Degrees", 360), ("Radians", 2 * np.pi)):
        got, _ = ksl(f"ksl_normalize{name}{f}", huge)
        assert (got >= 0).all() and (got < turn).all()
        got, _ = ksl(f"ksl_normalize{name}{f}", np.array([np.nan, np.inf, -np.inf], DTYPE[scalar]))
        assert np.isnan(got).all()


@F
def test_B14_tiny_negative_angles_stay_in_the_range(ksl, f, scalar):
    for name, turn in (("Degrees", 360), ("Radians", 2 * np.pi)):
        x = -(10.0 ** -np.arange(5, 38.0)).astype(DTYPE[scalar])
        got, _ = ksl(f"ksl_normalize{name}{f}", x)
        assert (got >= 0).all() and (got.astype(float) < turn).all()
    assert ksl(f"ksl_normalizeRadians{f}", np.array([-1e-17]))[0][0] == 0
    assert ksl(f"ksl_normalizeDegrees{f}", np.array([-1e-15]))[0][0] == 0


@F
@pytest.mark.parametrize("name, turn", [("catan2pi", 2 * PI), ("catan1pi", PI)])
def test_nearest_angle(ksl, f, scalar, name, turn, record_property):
    random = np.random.default_rng(2)
    x, y = random.normal(size=(2, N)).astype(DTYPE[scalar])
    theta = np.concatenate([random.uniform(-10, 10, N // 2), random.choice([-1, 1], N - N // 2) * 10.0 ** random.uniform(-5, 5, N - N // 2)]).astype(
        DTYPE[scalar]
    )
    got, _ = ksl(f"{name}{f}", y, x, theta)
    assert np.array_equal(got, ksl(f"ksl_{name}{f}", y, x, theta)[0])
    a = atan2(mp(y), mp(x))
    exact = a + turn * floor((mp(theta) - a) / turn + gmpy2.mpfr(0.5))
    error = abs((mp(got) - exact).astype(float))
    tie = abs(abs((exact - mp(theta)).astype(float)) - float(turn) / 2) < 1e-5 * np.maximum(1, abs(theta))
    worst = (error / ulp(exact, scalar))[~tie].max()
    record_property("worst_ulp", float(worst))
    assert worst <= 1.5
    assert (abs(got.astype(float) - theta) <= float(turn) / 2 + 4 * UNIT[scalar] * (4 + abs(theta))).all()


@F
def test_B13_the_angle_is_the_nearest(ksl, f, scalar):
    y, x, zero = np.array([np.sin(-1.0)]), np.array([np.cos(-1.0)]), np.array([0.0])
    assert np.isclose(ksl(f"catan2pi{f}", y, x, zero)[0][0], -1, rtol=1e-6)
    assert np.isclose(ksl(f"catan1pi{f}", y, x, zero)[0][0], -1, rtol=1e-6)
    assert np.isclose(ksl(f"catan2pi{f}", y, x, np.array([5.0]))[0][0], 2 * np.pi - 1, rtol=1e-6)
    assert np.isclose(ksl(f"catan1pi{f}", y, x, np.array([1.0]))[0][0], np.pi - 1, rtol=1e-6)


@F
def test_B13_huge_references_end(ksl, f, scalar):
    """Within half a turn and the rounding of the reference; no end to an infinite one."""
    huge = np.array([1e9, 5e8, -1e12, 1e18, -1e18, 1e30] + ([1e300] if scalar == "double" else []), DTYPE[scalar])
    one = np.ones(len(huge), DTYPE[scalar])
    for name in ("catan2pi", "catan1pi"):
        got, _ = ksl(f"{name}{f}", one, one, huge)
        assert (abs(got.astype(float) - huge.astype(float)) <= 4 + 4 * UNIT[scalar] * abs(huge.astype(float))).all()
        got, _ = ksl(f"{name}{f}", one[:2], one[:2], np.array([np.inf, np.nan], DTYPE[scalar]))
        assert not np.isfinite(got).any()


@F
def test_half_turns(ksl, f, scalar, record_property):
    """a + n π to 1.5 ULP"""
    random = np.random.default_rng(3)
    a = random.uniform(-np.pi, np.pi, N).astype(DTYPE[scalar])
    n = np.round(random.choice([-1, 1], N) * 10.0 ** random.uniform(-1, 6, N)).astype(DTYPE[scalar])
    got, _ = ksl(f"ksl_addHalfTurns{f}", a, n)
    exact = mp(a) + mp(n) * PI
    far = abs(exact.astype(float)) > 1  # ±1 half turn may cancel the angle
    worst = (abs((mp(got) - exact).astype(float)) / ulp(exact, scalar))[far].max()
    record_property("worst_ulp", float(worst))
    assert worst <= 1.5


@F
def test_smallest_angle_from(ksl, f, scalar):
    random = np.random.default_rng(4)
    a, least = random.uniform(-np.pi, np.pi, N).astype(DTYPE[scalar]), random.uniform(-30, 30, N).astype(DTYPE[scalar])
    for n in (1.0, 2.0):
        got = ksl(f"ksl_angleFrom{f}", a, np.full(N, n), least)[0].astype(float)
        assert (got >= least - 100 * UNIT[scalar]).all() and (got < least + n * np.pi + 100 * UNIT[scalar]).all()
        turns = (got - a) / (n * np.pi)
        assert abs(turns - np.round(turns)).max() < 100 * UNIT[scalar]
