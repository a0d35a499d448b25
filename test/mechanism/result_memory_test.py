"""The memory of large results is used again when their arrays are gone, and not before."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import ksl

STATES = 3000
"""Three results of 1.2 MB each."""


@pytest.fixture
def panda(examples):
    return ksl.load(examples / "robots/panda.urdf")


def derivatives(m, seed):
    q, v, a = np.random.default_rng(seed).uniform(-1, 1, (3, STATES, m.nv))
    return m.inverse_dynamics_derivatives(q, v, a)


def addresses(arrays):
    return {x.ctypes.data for x in arrays}


def test_memory_is_used_again_when_nothing_refers_to_it(examples):
    """In a process of its own: what other tests have left behind would be used first."""
    done = subprocess.run([sys.executable, __file__, examples / "robots/panda.urdf"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


def used_again(panda):
    first = derivatives(panda, 1)
    kept, view, before = [x.copy() for x in first], first[0][5:7], addresses(first)
    others = derivatives(panda, 2)
    assert not before & addresses(others)
    assert all(np.array_equal(x, y) for x, y in zip(first, kept))
    del first
    again = derivatives(panda, 3)  # the first array lives on in its view
    assert len(before & addresses(again)) == 2
    assert np.array_equal(view, kept[0][5:7])
    assert all(np.array_equal(x, y) for x, y in zip(derivatives(panda, 1), kept))


def test_arrays_own_their_memory_as_others_do(panda):
    x = derivatives(panda, 1)[0]
    assert x.flags.owndata and x.flags.writeable and x.base is None
    expected = x.copy()
    x.resize((2 * STATES, *x.shape[1:]), refcheck=False)
    assert np.array_equal(x[:STATES], expected) and not x[STATES:].any()
    x.resize((10, *x.shape[1:]), refcheck=False)
    assert np.array_equal(x, expected[:10])


def test_threads_get_memory_of_their_own(panda):
    expected = {seed: [x.copy() for x in derivatives(panda, seed)] for seed in range(4)}

    def right(seed):
        return all(np.array_equal(x, y) for _ in range(5) for x, y in zip(derivatives(panda, seed), expected[seed]))

    with ThreadPoolExecutor(4) as threads:
        assert all(threads.map(right, range(4)))


if __name__ == "__main__":
    used_again(ksl.load(sys.argv[1]))
