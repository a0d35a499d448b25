"""Array functions give the bits of the functions of one item, for every length and layout, and touch nothing else."""

import ctypes
import os
import re
import subprocess
import sys

import numpy as np
import pytest

import reference as ref
from functions import INCLUDE, SIZES, Type
from library import CTYPE, DTYPE

LINE = re.compile(r"^  KSL_ARRAY_([12])\(([^)]*)\)", re.M)
WIDTHS = SIZES | {"real": 1}


def functions():
    """{name: (scalar, types of the inputs, type of the output)}, as ksl/arrays.h lists them."""
    found = {}
    for count, row in LINE.findall((INCLUDE / "ksl" / "arrays.h").read_text()):
        name, namef, *rest = [x.strip() for x in row.split(",")]
        inputs, out = tuple(rest[0 : 2 * int(count) : 2]), rest[-1]
        found[name] = "double", inputs, out
        found[namef] = "float", inputs, out
    return found


FUNCTIONS = functions()
LENGTHS = (*range(18), 23, 31, 32, 33, 40)
"""Every remainder of a division by 16, the most lanes that there are, and several packs."""
GAP = 3
"""Numbers between two items of a strided array."""


def call(library, name, n, *operands):
    """operands: (address, stride)."""
    f = getattr(library.dll, f"ksl_array_{name}")
    f.restype = None
    f.argtypes = [ctypes.c_size_t] + [ctypes.c_void_p, ctypes.c_ssize_t] * len(operands)
    f(n, *[x for operand in operands for x in operand])


def one_by_one(library, name, inputs):
    """The functions of one item on the rows."""
    scalar, types, out = FUNCTIONS[name]
    if out == "real":
        return library(f"ksl_{name}", *inputs)[0].reshape(-1, 1)
    return library(f"ksl_{name}", *inputs, np.zeros((len(inputs[0]), WIDTHS[out])))[1][-1]


def samples(name, n, seed=0):
    scalar, types, _ = FUNCTIONS[name]
    random = np.random.default_rng(seed)
    return [np.array(ref.sample(random, max(n, 1), Type(t, "pointer", True, scalar)), DTYPE[scalar]).reshape(max(n, 1), -1)[:n] for t in types]


def same_bits(a, b):
    assert a.dtype == b.dtype and a.shape == b.shape
    return np.array_equal(np.ascontiguousarray(a).view(np.uint8), np.ascontiguousarray(b).view(np.uint8))


class Rows:
    """n items in memory of exactly the bytes that they span, beginning `shift` bytes past an aligned address."""

    def __init__(self, n, width, dtype, stride, shift=0):
        size = np.dtype(dtype).itemsize
        self.span = (abs(stride) * (n - 1) + width) * size if n else 0
        self.memory = np.frombuffer(bytearray(b"\x5a" * (self.span + 256)), np.uint8).copy()
        self.start = -self.memory.ctypes.data % 64 + 64 + shift
        numbers = self.memory[self.start : self.start + self.span].view(dtype) if self.span else np.zeros(0, dtype)
        self.rows = np.lib.stride_tricks.as_strided(numbers, (n, width), (abs(stride) * size, size))
        self.address = numbers.ctypes.data
        if stride < 0 and n:
            self.rows = self.rows[::-1]
            self.address += abs(stride) * (n - 1) * size
        self.stride = stride
        self.dtype = dtype

    def others(self):
        """Every byte that belongs to no item."""
        mine = np.zeros(len(self.memory), bool)
        for row in self.rows:
            at = row.ctypes.data - self.memory.ctypes.data
            mine[at : at + row.nbytes] = True
        return self.memory[~mine]

    def operand(self):
        return self.address, self.stride


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_length_and_layout(ksl, name):
    scalar, types, out = FUNCTIONS[name]
    dtype = DTYPE[scalar]
    for n in LENGTHS:
        x = samples(name, n, n)
        expected = one_by_one(ksl, name, x) if n else np.zeros((0, WIDTHS[out]), dtype)
        for layout in ("packed", "gaps", "backwards", "misaligned"):
            shift = np.dtype(dtype).itemsize if layout == "misaligned" else 0
            places = []
            for k, width in enumerate([WIDTHS[t] for t in (*types, out)]):
                stride = width + (GAP + k if layout in ("gaps", "backwards") else 0)
                places.append(Rows(n, width, dtype, -stride if layout == "backwards" else stride, shift * (k + 1)))
                if k < len(x):
                    places[k].rows[:] = x[k]
            before = [p.memory.copy() for p in places]
            call(ksl, name, n, *[p.operand() for p in places])
            assert same_bits(np.array(places[-1].rows), expected), (layout, n)
            assert all(np.array_equal(p.memory, b) for p, b in zip(places[:-1], before)), (layout, n)
            assert (places[-1].others() == 0x5A).all(), f"{layout}, {n}: something outside the items was written"


@pytest.mark.parametrize("name", [n for n in FUNCTIONS if len(FUNCTIONS[n][1]) == 2])
def test_stride_zero_is_one_item_for_all(ksl, name):
    scalar, types, out = FUNCTIONS[name]
    for n in (1, 7, 16, 37):
        for fixed in (0, 1):
            x = samples(name, n, n + fixed)
            one = x[fixed][:1].copy()
            x[fixed] = np.repeat(one, n, axis=0)
            expected = one_by_one(ksl, name, x)
            result = np.zeros((n, WIDTHS[out]), DTYPE[scalar])
            operands = [(a.ctypes.data, a.shape[1]) for a in x]
            operands[fixed] = one.ctypes.data, 0
            call(ksl, name, n, *operands, (result.ctypes.data, result.shape[1]))
            assert same_bits(result, expected)


@pytest.mark.parametrize("name,which", [(n, i) for n, (_, types, out) in FUNCTIONS.items() for i, t in enumerate(types) if WIDTHS[t] == WIDTHS[out]])
def test_in_place(ksl, name, which):
    for n in (1, 5, 8, 19, 40):
        x = samples(name, n, n)
        expected = one_by_one(ksl, name, x)
        operands = [(a.ctypes.data, a.shape[1]) for a in x]
        call(ksl, name, n, *operands, operands[which])
        assert same_bits(x[which], expected)


@pytest.mark.parametrize("name", [n for n, (_, types, out) in FUNCTIONS.items() if types == (out, out)])
def test_squares_in_place(ksl, name):
    """Both inputs and the output are one array."""
    x = samples(name, 21)[0]
    expected = one_by_one(ksl, name, [x.copy(), x.copy()])
    call(ksl, name, 21, *[(x.ctypes.data, x.shape[1])] * 3)
    assert same_bits(x, expected)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_nan_stays_in_its_item(ksl, name):
    x = samples(name, 20)
    expected = one_by_one(ksl, name, x)
    x[-1][11] = np.nan
    scalar, _, out = FUNCTIONS[name]
    result = np.zeros((20, WIDTHS[out]), DTYPE[scalar])
    call(ksl, name, 20, *[(a.ctypes.data, a.shape[1]) for a in x], (result.ctypes.data, result.shape[1]))
    others = np.arange(20) != 11
    assert same_bits(result[others], expected[others]) and np.isnan(result[11]).any()


def test_records(ksl):
    """Items inside larger records: a body of a pose, a wrench and a time."""
    n = 23
    bodies = np.random.default_rng(2).normal(size=(n, 19))
    expected = one_by_one(ksl, "product_CoAdc", [bodies[:, :12].copy(), bodies[:, 12:18].copy()])
    at = bodies.ctypes.data
    call(ksl, "product_CoAdc", n, (at, 19), (at + 12 * 8, 19), (at + 12 * 8, 19))
    assert same_bits(bodies[:, 12:18].copy(), expected)


EDGES = """
import ctypes, mmap, sys
sys.path.insert(0, sys.argv[1])
import numpy as np
from array_functions_test import FUNCTIONS, WIDTHS, DTYPE, call
from library import Library
library, page = Library(), mmap.PAGESIZE
libc = ctypes.CDLL(None, use_errno=True)

def walled():
    whole = mmap.mmap(-1, 6 * page)
    start = ctypes.addressof(ctypes.c_char.from_buffer(whole))
    for wall in (start, start + 5 * page):
        assert libc.mprotect(ctypes.c_void_p(wall), page, 0) == 0
    return whole, start + page, start + 5 * page

places = [walled() for _ in range(3)]
for name, (scalar, types, out) in FUNCTIONS.items():
    widths = [WIDTHS[t] for t in (*types, out)]
    for n in (1, 2, 7, 8, 9, 16, 31, 37):
        bytes_of = [w * n * np.dtype(DTYPE[scalar]).itemsize for w in widths]
        call(library, name, n, *[(low, w) for (_, low, _), w in zip(places, widths)])
        call(library, name, n, *[(high - b, w) for (_, _, high), b, w in zip(places, bytes_of, widths)])
"""


@pytest.mark.skipif(sys.platform != "linux", reason="needs mprotect")
@pytest.mark.parametrize("level", ["", "x86-64-v3", "x86-64-v2"])
def test_nothing_outside_is_read(level):
    """Arrays begin and end at pages that may not be touched, in a process of its own, which would die."""
    done = subprocess.run([sys.executable, "-c", EDGES, os.path.dirname(__file__)], capture_output=True, text=True, env=os.environ | {"KSL_ISA": level})
    assert done.returncode == 0 or "is no instruction set that runs here" in done.stderr, done.stderr


SCRIPT = """
import sys
sys.path.insert(0, sys.argv[1])
import numpy as np
from array_functions_test import FUNCTIONS, WIDTHS, DTYPE, call, samples
from library import Library
library, all_results = Library(), []
for name, (scalar, types, out) in FUNCTIONS.items():
    x = samples(name, 37, 5)
    result = np.zeros((37, WIDTHS[out]), DTYPE[scalar])
    call(library, name, 37, *[(a.ctypes.data, a.shape[1]) for a in x], (result.ctypes.data, result.shape[1]))
    all_results.append(result.tobytes())
sys.stdout.buffer.write(b"".join(all_results))
"""


def test_every_instruction_set_gives_the_same_bits():
    """In a process of its own, because the set is chosen once; sets that do not run here are refused."""
    found = {}
    for level in ("", "x86-64-v2", "x86-64-v3", "x86-64-v4"):
        done = subprocess.run([sys.executable, "-c", SCRIPT, os.path.dirname(__file__)], capture_output=True, env=os.environ | {"KSL_ISA": level})
        if done.returncode == 0:
            found[level] = done.stdout
        else:
            assert level and b"is no instruction set that runs here" in done.stderr, done.stderr
    assert found[""] and len(set(found.values())) == 1


@pytest.mark.parametrize("compiler", ["gcc", "clang", "g++", "clang++"])
def test_the_header_compiles_alone(compiler):
    language = "c++" if compiler.endswith("++") else "c"
    run = subprocess.run(
        [
            compiler,
            f"-std={'c++20' if language == 'c++' else 'c11'}",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-pedantic",
            "-fsyntax-only",
            f"-I{INCLUDE}",
            "-x",
            language,
            "-",
        ],
        input="#include <ksl/arrays.h>\n#include <ksl/arrays.h>\n",
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stderr


def test_all_are_there():
    """Both precisions of 31 functions; the twins differ in nothing but the scalar."""
    assert len(FUNCTIONS) == 2 * 31
    assert set(CTYPE) >= {scalar for scalar, _, _ in FUNCTIONS.values()}
