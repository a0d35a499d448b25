"""First derivatives on random trees against differences of the algorithms themselves, along q ⊕ s e_k, v and a or τ."""

import numpy as np
import pytest

from frames import placements
from projection import with_mimics
from random_tree import load_text, random_external, random_model, random_states, random_tree

TREES = range(24)
STEP = 2e-3
OFFSETS = np.array([1, 2, 3, 4])
WEIGHTS = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280]) / STEP
"""Central differences of order eight."""


def differences(m, algorithm, q, x, y) -> list[np.ndarray]:
    """Derivatives of algorithm(q, x, y) (n, …) by q, x and y, each (…, nv)."""
    steps = np.concatenate([OFFSETS, -OFFSETS])[:, None, None] * STEP * np.eye(m.nv)  # (steps, nv, nv)
    weights = np.concatenate([WEIGHTS, -WEIGHTS])
    n = steps.shape[:2]
    tile = lambda z: np.broadcast_to(z, (*n, z.shape[-1])).reshape(-1, z.shape[-1])
    moved = steps.reshape(-1, m.nv)
    found = []
    for at in ((m.integrate(tile(q), moved), tile(x), tile(y)), (tile(q), tile(x) + moved, tile(y)), (tile(q), tile(x), tile(y) + moved)):
        results = algorithm(*at)
        found.append(np.moveaxis(np.tensordot(weights, results.reshape(*n, *results.shape[1:]), 1), 0, -1))
    return found


def case(seed: int, heavy: bool = False):
    """A robot, every third with mimic joints, and a state."""
    rng = np.random.default_rng(seed)
    bodies, options = int(rng.integers(2, 12)), {"floating_base": bool(rng.integers(2))}
    if seed % 3:
        m = random_model(rng, bodies, massless=0.0 if heavy else 0.15, **options)
    else:
        m = load_text(with_mimics(random_tree(rng, bodies + 4), rng), **options)
    q, v, a = (x[0] for x in random_states(m, rng, 1))
    return m, rng, q, v, a, {name: w[0] for name, w in random_external(m, rng, 1).items()}


def close(found, expected, tolerance: float) -> None:
    for analytic, difference, by in zip(found, expected, ("q", "the second", "the third"), strict=True):
        assert analytic.shape == difference.shape
        scale = max(1.0, np.abs(analytic).max(initial=0))
        assert np.abs(analytic - difference).max(initial=0) < tolerance * scale, f"by {by}"


@pytest.mark.parametrize("seed", TREES)
def test_inverse_dynamics(seed):
    m, _, q, v, a, external = case(seed)
    if m.nv:
        found = m.inverse_dynamics_derivatives(q, v, a, external)
        close(found, differences(m, lambda *at: m.inverse_dynamics(*at, external), q, v, a), 1e-9)
        assert np.abs(found[2] - m.mass_matrix(q)).max() <= 1e-13 * np.abs(found[2]).max()


@pytest.mark.parametrize("seed", TREES)
def test_gradient_of_inverse_dynamics(seed):
    """It is the product of weights and derivatives, which have no step in common with it; with mimic joints, too."""
    m, rng, q, v, a, _ = case(seed)
    if m.nv:
        weights = rng.normal(size=m.nv)
        found = m.inverse_dynamics_gradient(q, v, a, weights)
        for gradient, derivative in zip(found, m.inverse_dynamics_derivatives(q, v, a), strict=True):
            assert np.abs(gradient - weights @ derivative).max() < 1e-12 * max(1.0, np.abs(derivative).max() * np.abs(weights).sum())
        single = m.inverse_dynamics_gradient(*(x.astype(np.float32) for x in (q, v, a, weights)))
        for gradient, exact in zip(single, found, strict=True):
            assert gradient.dtype == np.float32 and np.abs(gradient - exact).max() < 1e-3 * max(1.0, np.abs(exact).max())


@pytest.mark.parametrize("seed", TREES)
def test_forward_dynamics(seed):
    """Accelerations bend with the inverse of the mass matrix: its condition enters the error of the differences."""
    m, _, q, v, tau, external = case(seed, heavy=True)
    if m.nv and (condition := np.linalg.cond(m.mass_matrix(q))) < 1e6:
        found = m.forward_dynamics_derivatives(q, v, tau, external)
        close(found, differences(m, lambda *at: m.forward_dynamics(*at, external), q, v, tau), 1e-10 * max(condition, 10))
        W = m.mass_matrix_inverse(q)
        a = m.forward_dynamics(q, v, tau, external)
        by_q, by_v, _ = m.inverse_dynamics_derivatives(q, v, a, external)
        for other, of_efforts in zip(found, (by_q, by_v, -np.eye(m.nv))):
            assert np.abs(other + W @ of_efforts).max() < 1e-14 * condition * m.nv * max(1.0, np.abs(other).max())


@pytest.mark.parametrize("seed", TREES)
def test_reactions(seed):
    """Of some joints, fixed ones among them, wherever and in whatever axes they are asked for, and of every part."""
    m, rng, q, v, a, external = case(seed)
    joints = [str(name) for name in rng.choice([j.name for j in m.joints], 3)]
    if m.nv:
        for part in ("total", "constraint", "actuation", "coupling"):
            options = {"joints": joints, "part": part, **placements(rng, m)}
            found = m.reactions_derivatives(q, v, a, external, **options)
            close(found, differences(m, lambda *at: m.reactions(*at, external, **options), q, v, a), 1e-9)
