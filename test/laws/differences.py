"""Differences of algorithms along q ⊕ s e_k, v and a or τ, and random trees to take them on."""

import numpy as np

from projection import with_mimics
from random_tree import load_text, random_external, random_model, random_states, random_tree

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
