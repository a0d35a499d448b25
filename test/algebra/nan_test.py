"""NaN in a number that a result depends on gives NaN out: for every function and every number of its arguments.  And no number
that there is stops a call.

A result depends on a number if some finite change of that number changes it: small, of its sign, to zero, or large."""

import zlib

import numpy as np
import pytest

from cases import DTYPE
from every_number import CASES, arguments, changes, differ, is_number, results, varied, with_numbers


FILES = pytest.mark.parametrize("file", sorted({f.header for f in with_numbers()}))


def of_file(file):
    """Functions that a header or a file of bodies has, and random numbers for each."""
    return [(f, np.random.default_rng(zlib.crc32(f.name.encode()))) for f in with_numbers() if f.header == file]


@FILES
def test_nan_in_gives_nan_out(ksl, file):
    for f, random in of_file(file):
        args = arguments(f, random)
        before, found = results(ksl, f, args), 0
        for (argument, number), after in varied(ksl, f, args, lambda x: [*changes(x), np.nan]):
            depends = differ(before, after[:-1])
            missing = depends & ~np.isnan(after[-1])
            found += depends.any()
            assert not missing.any(), f"{f.name}: argument {argument}, number {number}: {np.argwhere(missing)[:4].tolist()} of (case, result) are numbers"
        assert found or not any(t.const or t.kind == "value" for t in f.args), f.name


@FILES
def test_any_number_is_survived(ksl, file):
    """Zeros, infinities, NaN, the largest and the smallest numbers, everywhere: the call comes back."""
    for f, random in of_file(file):
        args = arguments(f, random)
        for k, t in enumerate(f.args):
            if is_number(t):
                limits = np.finfo(DTYPE[t.scalar])
                special = [0.0, -0.0, 1, np.inf, -np.inf, np.nan, limits.max, -limits.max, limits.tiny, limits.smallest_subnormal]
                args[k] = random.choice(np.array(special, DTYPE[t.scalar]), args[k].shape)
        with np.errstate(all="ignore"):
            assert len(results(ksl, f, args)) == CASES
