"""Random states of a model, quaternions of unit length."""

import numpy as np


def random_states(m, rng, *leading):
    """q, v, a with these leading axes, numbers between −2 and 2."""
    q, v, a = (rng.uniform(-2, 2, (*leading, width)) for width in (m.nq, m.nv, m.nv))
    for j in m.joints:
        if j.quaternion is not None:
            part = q[..., j.q_index + j.quaternion : j.q_index + j.nq]
            part /= np.linalg.norm(part, axis=-1, keepdims=True)
    return q, v, a
