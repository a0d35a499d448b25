"""Axis, pitch and magnitude of twists and wrenches: against 200 bits, and every pure case."""

import numpy as np
import pytest

import reference as ref
from cases import arithmetic  # noqa: F401, a fixture
from cases import CASES, DTYPE, PRECISIONS, bound, close, error, room, sample
from reference import UNIT, cross, dot, mp, norm

pytestmark = pytest.mark.usefixtures("arithmetic")
BOTH = pytest.mark.parametrize("scalar, f", PRECISIONS)
KINDS = pytest.mark.parametrize("kind", ["screw", "coscrew"])


def parts(kind, x):
    """(main, moment): (ω, v) of a screw, (f, τ) of a coscrew."""
    return (x[:, 3:], x[:, :3]) if kind == "screw" else (x[:, :3], x[:, 3:])


def joined(kind, main, moment):
    return np.concatenate([moment, main] if kind == "screw" else [main, moment], 1)


def axis(ksl, kind, f, x):
    """direction, point, pitch, magnitude"""
    scalar = "float" if f else "double"
    n = len(x)
    magnitude, (_, e, p, h) = ksl(f"ksl_{kind}{f}_getAxis", x, room(3, scalar, n), room(3, scalar, n), room(1, scalar, n))
    return e, p, h[:, 0], magnitude


@BOTH
@KINDS
def test_axis(ksl, kind, scalar, f, record_property):
    x = sample(kind, scalar)
    a, b = (norm(mp(y)) for y in parts(kind, x))
    x = x[a > 4 * UNIT[scalar] * b]
    main, moment = parts(kind, mp(x))
    e, p, h, magnitude = axis(ksl, kind, f, x)
    n = ref.sqrt(dot(main, main))
    unit = main / n[:, None]
    size = norm(moment) / norm(main)
    worst = max(
        error(e, unit, 1, scalar),
        error(magnitude, n, norm(main), scalar),
        error(p, cross(unit, moment) / n[:, None], size, scalar),
        error(h, dot(unit, moment) / n, size, scalar),
    )
    assert len(x) > CASES / 2
    bound(record_property, worst, 5)


@BOTH
@KINDS
def test_from_axis(ksl, kind, scalar, f, record_property):
    e, p = sample("vec3", scalar), sample("vec3", scalar, 1)
    e = (e / np.linalg.norm(e.astype(float), axis=1)[:, None]).astype(e.dtype)
    h, m = sample("real", scalar), sample("real", scalar, 1)
    (got,) = ksl.outputs(f"ksl_{kind}{f}_fromAxis", e, p, h, m, room(6, scalar))
    main, moment = parts(kind, got)
    e, p, h, m = mp(e), mp(p), mp(h), mp(m)
    expected = m[:, None] * (cross(p, e) + h[:, None] * e)
    am = abs(m.astype(float))
    worst = max(error(main, m[:, None] * e, am, scalar), error(moment, expected, am * (norm(p) + abs(h.astype(float))), scalar))
    bound(record_property, worst)


@BOTH
@KINDS
def test_there_and_back(ksl, kind, scalar, f):
    x = sample(kind, scalar, moderate=True)
    e, p, h, m = axis(ksl, kind, f, x)
    close(ksl.outputs(f"ksl_{kind}{f}_fromAxis", e, p, h, m, room(6, scalar))[0], x, scalar)
    close((e * p).sum(1), 0 * m, scalar)  # of the axis's points the nearest to the origin


@BOTH
@KINDS
@pytest.mark.parametrize("scale", [1e-12, 1, 1e12])
def test_pure_cases(ksl, kind, scalar, f, scale):
    """A translation or couple, exact or with a residue below ε, whatever its size: infinite pitch, nothing NaN."""
    moment = (scale * np.array([[3, 0, 4.0]])).astype(DTYPE[scalar])
    main = (5 * scale * np.array([[0, 1.0, 0]])).astype(DTYPE[scalar])
    for residue in (0, UNIT[scalar], 2 * UNIT[scalar] * (1 - 2 * UNIT[scalar])):
        e, p, h, m = axis(ksl, kind, f, joined(kind, (main * residue).astype(main.dtype), moment))
        assert np.isposinf(h[0]) and np.all(p == 0)
        close(e, [[0.6, 0, 0.8]], scalar, 4)
        assert abs(m[0] / (5 * scale) - 1) <= 4 * UNIT[scalar]
        back = ksl.outputs(f"ksl_{kind}{f}_fromAxis", e, p, h, m, room(6, scalar, 1))[0]
        close(back / scale, joined(kind, 0 * main, moment) / scale, scalar, 8)
    # above the threshold it has an axis, far away
    e, p, h, m = axis(ksl, kind, f, joined(kind, (main * 4 * UNIT[scalar]).astype(main.dtype), moment))
    assert np.isfinite(h[0]) and np.linalg.norm(p) > 0.1 / UNIT[scalar]
    # no moment: through the origin, no pitch
    e, p, h, m = axis(ksl, kind, f, joined(kind, main, 0 * moment))
    assert h[0] == 0 and np.all(p == 0) and np.allclose(e, [[0, 1, 0]])


@BOTH
@KINDS
def test_zero_and_nan(ksl, kind, scalar, f):
    e, p, h, m = axis(ksl, kind, f, room(6, scalar, 1))
    assert np.all(e == 0) and np.all(p == 0) and h[0] == 0 and m[0] == 0
    x = room(6, scalar, 6)
    x[range(6), range(6)] = np.nan
    e, _, h, m = axis(ksl, kind, f, x)
    assert np.isnan(h).all() and np.isnan(m).all() and np.isnan(e).all()


@BOTH
@KINDS
def test_the_rule_is_that_of_the_norm(ksl, kind, scalar, f):
    x = sample(kind, scalar)
    (n,) = ksl.outputs(f"ksl_{kind}{f}_norm", x)
    assert np.array_equal(axis(ksl, kind, f, x)[3], n)


@BOTH
@KINDS
def test_the_axis_moves_with_the_frame(ksl, kind, scalar, f):
    """Under a pose direction and axis move, pitch and magnitude stay."""
    D, x = sample("SE3", scalar, moderate=True), sample(kind, scalar, moderate=True)
    y = ksl.outputs(f"ksl_product_{'Ads' if kind == 'screw' else 'CoAdc'}{f}", D, x, room(6, scalar))[0]
    (e, p, h, m), (e2, p2, h2, m2) = axis(ksl, kind, f, x), axis(ksl, kind, f, y)
    close(m2, m, scalar)
    close(h2, h, scalar, 1000)
    close(e2, ksl.outputs(f"ksl_product_drv{f}", D[:, :9], e, room(3, scalar))[0], scalar)
    q = ksl.outputs(f"ksl_product_dv{f}", D, p, room(3, scalar))[0].astype(float)
    close(np.cross(q - p2, e2.astype(float)), np.zeros((CASES, 3)), scalar, 4000)  # on the same line
