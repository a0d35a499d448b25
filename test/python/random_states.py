"""Random states of a model, quaternions of unit length."""

import numpy as np


def random_states(m, rng, *leading):
    """q, v, a with these leading axes, numbers between −2 and 2."""
    q, v, a = (rng.uniform(-2, 2, (*leading, width)) for width in (m.nq, m.nv, m.nv))
    if m.nq != m.nv:
        q[..., 3:7] /= np.linalg.norm(q[..., 3:7], axis=-1, keepdims=True)
    return q, v, a
