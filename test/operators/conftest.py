import ctypes
import gc
import sys

import pytest
from operator_cases import ROBOTS, robot_named


@pytest.fixture(scope="module", params=ROBOTS)
def robot(request):
    return robot_named(request.param)


@pytest.fixture(scope="module", autouse=True)
def memory_is_given_back():
    """JAX leaves 2 GB of compiled programs: each copy of this process that later tests make would take a tenth of a second more."""
    yield
    if "jax" in sys.modules:
        sys.modules["jax"].clear_caches()
        gc.collect()
        if hasattr(ctypes.CDLL(None), "malloc_trim"):  # glibc
            ctypes.CDLL(None).malloc_trim(0)
