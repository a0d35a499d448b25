"""Kernels compiled by a compiler of C++ and run on the processor (on_host.hpp), for tests."""

import ctypes
import shutil
import tempfile
from pathlib import Path

import numpy as np
from generated_code import run

FLAGS = "-std=c++17 -O0 -ffp-contract=off -Wall -Wextra -Wconversion -Wdouble-promotion -Wno-sign-conversion -Wno-unknown-pragmas -Werror -fPIC -shared".split()
HERE = Path(__file__).resolve().parent
GUARD = 3
"""Numbers behind each row, and rows behind the last, which no kernel may touch."""


def compiler():
    return next(x for x in ("clang++", "g++", "c++") if shutil.which(x))


class Kernels:
    """Kernels of a text, to be called with arrays of rows."""

    pointer = ctypes.c_void_p

    def __init__(self, text, kernels, folder):
        self.kernels = {(k.function.name, k.coalesced): k for k in kernels}
        calls = []
        for k in kernels:
            names = [*(name for name, _ in k.inputs), *(name for name, _ in k.results)]
            typed = [f"const {k.scalar} *{name}, long long {name}_stride" for name, _ in k.inputs] + [
                f"{k.scalar} *{name}, long long {name}_stride" for name, _ in k.results
            ]
            given = ", ".join(["n", *(f"{name}, {name}_stride" for name in names)])
            calls.append(
                f'extern "C" void run_{k.name}(long long n, {", ".join(typed)}) {{ on_host::grid((unsigned)((n + {k.threads - 1}) / {k.threads}), {k.threads}, [&] {{ {k.name}({given}); }}); }}\n'
            )
        folder = Path(tempfile.mkdtemp(dir=folder))  # a library that is loaded is not written to
        (folder / "kernels.cpp").write_text('#include "on_host.hpp"\n' + text + "".join(calls))
        run(compiler(), *FLAGS, f"-I{HERE}", f"-I{folder.parent}", "kernels.cpp", "-o", "kernels.so", cwd=folder)
        self.library = ctypes.CDLL(str(folder / "kernels.so"))

    def __call__(self, name, inputs, coalesced=False, wide=0):
        """The results for rows of inputs; one row alone is for all states.  wide: so many numbers lie between rows or columns."""
        kernel = self.kernels[name, coalesced]
        dtype = np.float64 if kernel.scalar == "double" else np.float32
        n = max(len(x) for x in inputs)
        given = [_laid(np.asarray(x, dtype), coalesced, wide, n) for x in inputs]
        out = [_laid(np.full((n, int(np.prod(shape, dtype=int))), np.nan, dtype), coalesced, wide, n) for _, shape in kernel.results]
        self._run(kernel, n, given + out)
        results = []
        for (array, _), (_, shape) in zip(out, kernel.results):
            rows = array.T if coalesced else array
            size = int(np.prod(shape, dtype=int))
            assert np.isnan(rows[n:]).all() and np.isnan(rows[:, size:]).all(), f"{kernel.name} writes where no result is"
            results.append(np.ascontiguousarray(rows[:n, :size]).reshape(n, *shape))
        return results

    def in_place(self, name, inputs, there, which, coalesced):
        """The one result is written to `there`, which is the input of this number."""
        given = [_laid(x, coalesced, 0, len(x)) for x in inputs]
        given[which] = there, there.shape[1]
        self._run(self.kernels[name, coalesced], len(inputs[0]), [*given, given[which]])

    def _run(self, kernel, n, given):
        arguments = [x for array, stride in given for x in (ctypes.c_void_p(array.ctypes.data), ctypes.c_longlong(stride))]
        self.library[f"run_{kernel.name}"](ctypes.c_longlong(n), *arguments)


def _laid(rows, coalesced, wide, n):
    """The array that a kernel is given, and its stride."""
    if len(rows) == 1 and n > 1:
        return np.ascontiguousarray(rows), 0
    array = np.full((n + GUARD, rows.shape[1] + wide) if not coalesced else (rows.shape[1] + GUARD, n + wide), np.nan, rows.dtype)
    (array.T if coalesced else array)[: len(rows), : rows.shape[1]] = rows
    return array, array.shape[1]
