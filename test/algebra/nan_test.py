"""NaN in a number that a result depends on gives NaN out: for every function and every number of its arguments.  And no number
that there is stops a call.

A result depends on a number if some finite change of that number changes it: small, of its sign, to zero, or large."""

import zlib

import numpy as np
import pytest

from cases import DTYPE
from every_number import CASES, FUNCTIONS, arguments, changes, is_number, numbers, results, with_numbers


@pytest.mark.parametrize("name", [f.name for f in with_numbers()])
def test_nan_in_gives_nan_out(ksl, name):
    f = FUNCTIONS[name]
    args = arguments(f, np.random.default_rng(zlib.crc32(name.encode())))
    before, found = results(ksl, f, args), 0
    for one in numbers(ksl, f, args):
        depends = one.decides(before, changes(one.values))
        missing = depends & ~np.isnan(one.with_values(np.nan))
        found += depends.any()
        assert not missing.any(), f"argument {one.argument}, number {one.number}: {np.argwhere(missing)[:4].tolist()} of (case, result) are numbers"
    assert found or not any(t.const or t.kind == "value" for t in f.args)


@pytest.mark.parametrize("name", [f.name for f in with_numbers()])
def test_any_number_is_survived(ksl, name):
    """Zeros, infinities, NaN, the largest and the smallest numbers, everywhere: the call comes back."""
    f = FUNCTIONS[name]
    random = np.random.default_rng(zlib.crc32(name.encode()))
    args = arguments(f, random)
    for k, t in enumerate(f.args):
        if is_number(t):
            limits = np.finfo(DTYPE[t.scalar])
            special = [0.0, -0.0, 1, np.inf, -np.inf, np.nan, limits.max, -limits.max, limits.tiny, limits.smallest_subnormal]
            args[k] = random.choice(np.array(special, DTYPE[t.scalar]), args[k].shape)
    with np.errstate(all="ignore"):
        assert len(results(ksl, f, args)) == CASES
