"""Physical consistency: against bodies made of point masses, and log-Cholesky coordinates against differences."""

import numpy as np
import pytest

from ksl.consistency import (
    BASIS,
    barrier,
    barrier_gradient,
    consistency_metric,
    from_log_cholesky,
    from_pseudo_inertia,
    is_consistent,
    log_cholesky,
    log_cholesky_jacobian,
    nearest_consistent,
    pseudo_inertia,
)


def of_points(masses, points):
    """Parameters of point masses, by the definitions."""
    I = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, points))
    return np.array([masses.sum(), *(masses @ points), I[0, 0], I[0, 1], I[1, 1], I[0, 2], I[1, 2], I[2, 2]])


@pytest.fixture(params=range(20))
def body(request):
    rng = np.random.default_rng(request.param)
    return of_points(rng.uniform(0.1, 2, 8), rng.normal(size=(8, 3)) * rng.uniform(0.01, 1, 3) + rng.normal(size=3))


def test_pseudo_inertia_is_the_integral(body):
    rng = np.random.default_rng(1)
    masses, points = rng.uniform(0.1, 2, 6), rng.normal(size=(6, 3))
    x = np.column_stack([points, np.ones(6)])
    assert np.allclose(pseudo_inertia(of_points(masses, points)), np.einsum("n,ni,nj->ij", masses, x, x), atol=1e-14)
    assert np.allclose(from_pseudo_inertia(pseudo_inertia(body)), body, atol=1e-13)


def test_what_can_be_a_body(body):
    assert is_consistent(body) and is_consistent(np.stack([body, body])).all()
    rng = np.random.default_rng(2)
    flat = of_points(rng.uniform(0.1, 1, 5), rng.normal(size=(5, 3)) * [1, 1, 0])
    assert not is_consistent(flat)  # a limit of bodies
    for change in (np.array([-2 * body[0], *np.zeros(9)]), np.array([0, 0, 0, 0, 10 * np.abs(body).max(), 0, 0, 0, 0, 0])):
        assert not is_consistent(body + change)
    assert is_consistent(body * 1e-9) and not is_consistent(np.zeros(10))


def test_log_cholesky_and_back(body):
    theta = log_cholesky(body)
    assert np.allclose(from_log_cholesky(theta), body, rtol=1e-12, atol=1e-12 * np.abs(body).max())
    assert np.exp(2 * theta[0]) == pytest.approx(body[0])
    anything = np.random.default_rng(3).normal(size=(50, 10))
    assert is_consistent(from_log_cholesky(anything)).all()
    assert np.allclose(log_cholesky(from_log_cholesky(anything)), anything, atol=1e-9)
    with pytest.raises(ValueError, match="no body of positive density"):
        log_cholesky(-body)


def differences(f, x, h=1e-6):
    return np.stack([(np.asarray(f(x + h * e)) - f(x - h * e)) / (2 * h) for e in np.eye(len(x))], axis=-1)


def test_derivatives(body):
    theta = log_cholesky(body)
    assert np.allclose(log_cholesky_jacobian(theta), differences(from_log_cholesky, theta), rtol=1e-6, atol=1e-7 * np.abs(body).max())
    scale = 1 / np.sqrt(np.diag(consistency_metric(body)))
    by_difference = differences(lambda x: barrier(body + scale * x), np.zeros(10), 1e-5) / scale
    assert np.allclose(barrier_gradient(body) * scale, by_difference * scale, atol=1e-6)
    second = differences(lambda x: barrier_gradient(body + scale * x) * scale, np.zeros(10), 1e-5)
    assert np.allclose(second, consistency_metric(body) * scale * scale[:, None], atol=1e-6)


def test_the_metric_is_the_same_in_other_axes_and_units(body):
    """Length of a change: of the body seen from another frame, in other units."""
    rng = np.random.default_rng(4)
    change = 0.01 * body * rng.normal(size=10)
    T = np.eye(4)
    T[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0] * 1000
    T[:3, 3] = rng.normal(size=3)
    elsewhere = lambda phi: from_pseudo_inertia(7 * T @ np.einsum("k,kij->ij", phi, BASIS) @ T.T)
    there = elsewhere(change)
    assert there @ consistency_metric(elsewhere(body)) @ there == pytest.approx(change @ consistency_metric(body) @ change, rel=1e-6)


def test_near_bodies_for_impossible_ones(body):
    assert np.allclose(nearest_consistent(body), body)
    broken = body + np.array([0, 0, 0, 0, 3 * body[[4, 6, 9]].sum(), 0, 0, 0, 0, 0])
    mended = nearest_consistent(broken)
    assert is_consistent(mended) and np.array_equal(mended[:4], broken[:4])
    with pytest.raises(ValueError, match="positive masses"):
        nearest_consistent(np.zeros(10))


def test_shapes_are_checked():
    with pytest.raises(ValueError, match=r"shape \(…, 10\), found shape \(9,\)"):
        pseudo_inertia(np.zeros(9))


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e3])
def test_near_bodies_do_not_depend_on_the_size(body, scale):
    """Lengths in other units are other sizes.  1 cm was the size of a body of which nothing was known, also of one of 10 µm."""
    units = np.array([1, *[scale] * 3, *[scale**2] * 6])
    flat = body + np.array([0, 0, 0, 0, 3 * body[[4, 6, 9]].sum(), 0, 0, 0, 0, 0])
    point = np.array([*body[:4], *np.zeros(6)])
    for broken in (flat, point):
        assert nearest_consistent(broken * units) == pytest.approx(nearest_consistent(broken) * units, rel=1e-9)
        given = nearest_consistent(broken * units, length=0.3 * scale)
        assert given == pytest.approx(nearest_consistent(broken, length=0.3) * units, rel=1e-9)
    assert is_consistent(nearest_consistent(np.eye(10)[0]))
    with pytest.raises(ValueError, match="length=0; expected a positive number, m"):
        nearest_consistent(body, length=0)
