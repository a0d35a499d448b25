"""The shared library through ctypes: functions called on many cases at once, arguments as numpy arrays.  Helpers, which are
no symbols of it, are compiled here for their tests."""

import ctypes
import os
import subprocess
import tempfile
from functools import cached_property
from pathlib import Path

import numpy as np

from functions import INTEGERS, ROOT, SIZES, everything

DTYPE = {"double": np.float64, "float": np.float32, "int": np.int32}
STRUCTS = SIZES | INTEGERS
CTYPE = {"double": ctypes.c_double, "float": ctypes.c_float, "int": ctypes.c_int}


def c_compiler(*flags):
    """How tests compile C: with gcc and these flags, or as KSL_TEST_CC says, which `make coverage` sets to count what runs."""
    return os.environ["KSL_TEST_CC"].split() if "KSL_TEST_CC" in os.environ else ["gcc", *flags]


def find():
    """The path in KSL_LIBRARY, or the newest build/*/libksl.so."""
    if path := os.environ.get("KSL_LIBRARY"):
        if not Path(path).exists():
            raise FileNotFoundError(f"KSL_LIBRARY names {path}, which does not exist")
        return Path(path)
    found = [p for p in ROOT.glob("build/**/libksl.so") if p.is_file()]
    if not found:
        raise FileNotFoundError("libksl.so was not found: build it (cmake --build build/...) or name it in KSL_LIBRARY")
    return max(found, key=lambda p: p.stat().st_mtime)


def by_value(t):
    """A ctypes structure for a type that is passed or returned by value."""
    fields = [(f"x{i}", CTYPE[t.scalar]) for i in range(t.numbers())]
    return type(f"{t.base}_{t.scalar}", (ctypes.Structure,), {"_fields_": fields})


class Library:
    def __init__(self):
        self.path = find()
        self.dll = ctypes.CDLL(str(self.path))
        self.functions = everything()
        self._ready = {}

    @cached_property
    def helpers(self):
        """src/ksl.c once more, with the helpers as symbols."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "helpers.so"
            flags = ["-std=c11", "-ffp-contract=off", "-fPIC", "-shared", "-DKSL_INLINE_HELPER=extern inline KSL_EXPORT"]
            subprocess.run([*c_compiler("-O0"), *flags, "-I", ROOT / "include", ROOT / "src" / "ksl.c", "-o", path, "-lm"], check=True)
            return ctypes.CDLL(str(path))

    def _function(self, name):
        """The callable, its signature and the structures of its by-value arguments."""
        if name not in self._ready:
            f = self.functions[name]
            call = getattr(self.helpers if f.helper else self.dll, name)
            structs = [by_value(t) if t.kind == "value" and t.base in STRUCTS else None for t in f.args]
            call.argtypes = [
                s
                or (
                    ctypes.c_void_p
                    if t.kind != "value"
                    else CTYPE[t.scalar]
                    if t.base == "real"
                    else ctypes.c_ssize_t
                    if t.base == "ptrdiff_t"
                    else ctypes.c_int
                )
                for s, t in zip(structs, f.args)
            ]
            r = f.returns
            call.restype = (
                ctypes.c_void_p
                if r.kind == "pointer"
                else by_value(r)
                if r.base in STRUCTS
                else {"void": None, "bool": ctypes.c_bool, "int": ctypes.c_int}.get(r.base, CTYPE.get(r.scalar))
            )
            self._ready[name] = call, f, structs
        return self._ready[name]

    def __call__(self, name, *args, alias=None, inside=None):
        """Call name once per row of its arguments (arrays of shape (n, numbers), (n,) for scalars, or one int for all).
        Returns (what it returned, list of the arguments after the calls).  alias=(i, j): argument i is argument j
        itself; inside=(i, j, k): argument i begins at number k of argument j."""
        call, f, structs = self._function(name)
        n = max((len(a) for a in args if not np.isscalar(a)), default=1)
        after, columns = [], []
        for t, s, a in zip(f.args, structs, args):
            if t.kind != "value":
                x = np.array(a, dtype=DTYPE[t.scalar], order="C").reshape(n, -1)
                after.append(x)
                columns.append(range(x.ctypes.data, x.ctypes.data + x.nbytes, x.strides[0]))
            else:
                after.append(a)
                if s:
                    columns.append([s(*row) for row in np.asarray(a).reshape(n, -1).tolist()])
                else:
                    columns.append([a] * n if np.isscalar(a) else np.asarray(a).tolist())
        for i, j, k in [(*alias, 0)] if alias else [inside] if inside else []:
            offset = k * after[j].itemsize
            columns[i] = [p + offset for p in columns[j]]
            width = f.args[i].numbers()
            after[i] = after[j][:, k : k + width]
        result = [call(*row) for row in zip(*columns)] if columns else [call()]
        if f.returns.kind == "pointer":
            return result, after
        if f.returns.base in STRUCTS:
            result = np.array([[getattr(r, k) for k, _ in r._fields_] for r in result], dtype=DTYPE[f.returns.scalar])
        elif f.returns.base != "void":
            result = np.array(result, dtype=DTYPE.get(f.returns.scalar) if f.returns.base == "real" else None)
        return result, after

    def outputs(self, name, *args, **options):
        """Only what the function computes: its result, or the pointers it may write."""
        f = self.functions[name]
        result, after = self(name, *args, **options)
        written = [x for t, x in zip(f.args, after) if t.kind == "pointer" and not t.const]
        return written if f.returns.base == "void" else [result] + written
