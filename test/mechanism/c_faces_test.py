"""What Python refuses, C refuses, too: overlapping memory, rows that overlap, names that say nothing.  And what a thread of a program does to a call: its
rounding mode, and its end."""

import ctypes
import itertools
import json
import os
import re
import shutil
import subprocess
import sys
from ctypes import POINTER, byref, c_char_p, c_double, c_float, c_int, c_size_t, c_ssize_t, c_void_p
from pathlib import Path

import numpy as np
import pytest

import ksl
from ksl import ufuncs

ROOT = Path(__file__).resolve().parents[2]
PANDA = ROOT / "examples/robots/panda.urdf"
STATES, FAR = 5, 1 << 18
BAD_ARGUMENT, NOT_FINITE = 1, 4
UNTOUCHED = -(2.0**40)
"""What room for results is filled with."""


@pytest.fixture(scope="module")
def library():
    path = os.environ.get("KSL_LIBRARY")
    assert path, "KSL_LIBRARY names the library that make test builds"
    found = ctypes.CDLL(path)
    found.ksl_error_message.restype = c_char_p
    return found


@pytest.fixture(scope="module")
def panda(library):
    model, data = c_void_p(), c_void_p()
    assert library.ksl_model_load(str(PANDA).encode(), None, byref(model)) == 0
    assert library.ksl_data_create(model, byref(data)) == 0
    yield model, data
    library.ksl_data_free(data), library.ksl_model_free(model)


def batch_calls():
    """{name: [(type, name of an argument)]} of every batch call of the header."""
    text = re.sub(r"/\*.*?\*/", "", (ROOT / "include/ksl/engine_calls.h").read_text(encoding="utf-8"), flags=re.DOTALL)
    found = {}
    for name, arguments in re.findall(r"ksl_status_t\s+(ksl_\w+_batchf?)\(\s*([^)]*)\)", text):
        found[name] = [re.match(r"(.*?)(\w+)$", " ".join(one.split())).groups() for one in arguments.split(",")]
    return found


CALLS = batch_calls()


class Batch:
    """One call's arguments, each of which can be replaced.  Results have room for any row, FAR numbers apart."""

    def __init__(self, name, model):
        self.scalar = c_float if name.endswith("f") else c_double
        m = ksl.load(PANDA)
        self.kept = {"links": (c_int * 1)(3), "joints": (c_int * 1)(3)}
        self.values, self.results, self.inputs = {}, [], []
        for kind, argument in CALLS[name]:
            if kind.strip() == "const double *" or kind.strip() == "const float *":
                length = m.nq if argument.startswith("q") else 1 if argument == "fraction" else m.nv
                numbers = np.full((STATES, length), 0.3, np.dtype(self.scalar))
                self.kept[argument], self.values[argument] = numbers, c_void_p(numbers.ctypes.data)
                self.values[argument + "_stride"] = c_ssize_t(length)
                self.inputs.append(argument)
            elif kind.strip() in ("double *", "float *"):
                room = np.full(STATES * FAR, UNTOUCHED, np.dtype(self.scalar))
                self.kept[argument], self.values[argument] = room, c_void_p(room.ctypes.data)
                self.values[argument + "_stride"] = c_ssize_t(FAR)
                self.results.append(argument)
        constants = {
            "model": model,
            "n": c_size_t(STATES),
            "links_n": 1,
            "joints_n": 1,
            "link": 3,
            "seen_from": 1,
            "threads": 1,
            "order": 0,
            "options": None,
            "external": None,
        }
        self.arguments = [(a, constants[a] if a in constants else self.kept[a] if a in ("links", "joints") else self.values[a]) for _, a in CALLS[name]]

    def run(self, library, name, **replaced):
        status = getattr(library, name)(*(replaced.get(a, value) for a, value in self.arguments))
        return status, library.ksl_error_message().decode()


@pytest.mark.parametrize("name", CALLS)
def test_batches_refuse_results_that_overwrite_what_is_still_to_be_read(library, panda, name):
    call = Batch(name, panda[0])
    status, said = call.run(library, name)
    assert status == 0, said
    size = ctypes.sizeof(call.scalar)
    for result in call.results:
        status, said = call.run(library, name, **{f"{result}_stride": c_ssize_t(0)})
        assert (status, result in said, "so that they overlap" in said) == (BAD_ARGUMENT, True, True), (name, said)
        for given in call.inputs:
            into = c_void_p(call.values[given].value + size)
            status, said = call.run(library, name, **{result: into})
            assert status == BAD_ARGUMENT and f"{result} overlaps " in said, (name, said)
        for other in call.results:
            if other != result:
                status, said = call.run(library, name, **{result: call.values[other]})
                assert status == BAD_ARGUMENT and "overlap; give each memory of its own" in said, (name, said)


@pytest.mark.parametrize("name", CALLS)
def test_batches_refuse_what_is_not_there(library, panda, name):
    """No array for one of those that a call needs.  A number that is none spoils its own state, as docs/start/embedded.md has it, and one that is too large is told."""
    call = Batch(name, panda[0])
    for missing in ("model", *call.inputs, *(["links"] if "links" in dict(call.arguments) else [])):
        status, said = call.run(library, name, **{missing: None})
        assert status == BAD_ARGUMENT and "null" in said, (name, missing, said)
    assert call.run(library, name)[0] == 0
    rows = lambda k: [written[written != UNTOUCHED] for written in (call.kept[result][k * FAR : (k + 1) * FAR] for result in call.results)]
    expected = rows(4)
    for given in call.inputs:
        for number in (np.nan, np.inf, 1e200 if call.scalar is c_double else 1e30):
            numbers = call.kept[given].copy()
            numbers[3, -1] = number
            status, said = call.run(library, name, **{given: c_void_p(numbers.ctypes.data)})
            assert status in (0, NOT_FINITE) and all(map(np.array_equal, rows(4), expected)), (name, given, number, said)
            assert status == NOT_FINITE or not np.isfinite(number) or all(np.isfinite(x).all() for x in rows(3)), (name, given, number)


HEADERS = ("engine.h", "engine_calls.h", "engine_building.h", "engine_loops.h", "engine_simulate.h")
ZEROS = """
import ctypes, json, sys
library = ctypes.CDLL(sys.argv[1])
for name, kinds in json.loads(sys.argv[2]):
    print(name, flush=True)
    status = getattr(library, name)(*(ctypes.c_double(0) if kind == "double" else ctypes.c_float(0) if kind == "float" else None if "*" in kind else 0 for kind in kinds))
    print(status, flush=True)
"""


def test_every_function_of_the_headers_takes_null():
    """A call with no model, no arrays and no options is refused, and ends no program."""
    declared = []
    for header in HEADERS:
        text = re.sub(r"/\*.*?\*/|//[^\n]*", "", (ROOT / "include/ksl" / header).read_text(encoding="utf-8"), flags=re.DOTALL)
        for name, arguments in re.findall(r"\b(?:ksl_status_t|int|void|const char \*)\s*(ksl_\w+)\(([^)]*)\);", text):
            kinds = [re.sub(r"\w+$", "", " ".join(one.split())).strip() for one in arguments.split(",")]
            declared.append((name, kinds if kinds != [""] else [], f"ksl_status_t {name}(" in " ".join(text.split())))
    assert len(declared) > 200
    done = subprocess.run([sys.executable, "-c", ZEROS, os.environ["KSL_LIBRARY"], json.dumps([row[:2] for row in declared])], capture_output=True, text=True)
    lines = done.stdout.split()
    assert done.returncode == 0, f"{lines[-1]}: {done.stderr}"
    assert [name for (name, _, has_status), status in zip(declared, lines[1::2], strict=True) if has_status and int(status) != BAD_ARGUMENT] == []


def test_rows_below_their_length_and_shifted_ones(library, panda):
    """tau with a stride of 6 numbers, and over q from its second number on, had status 0 and wrong numbers."""
    q = np.linspace(0, 1, 7 * STATES + 7)
    out = np.empty(7 * STATES)
    zero, name = np.zeros((STATES, 7)), library.ksl_inverse_dynamics_batch

    def run(q, out, stride, n=STATES):
        p = [c_void_p(x.ctypes.data) for x in (q, zero, zero, out)]
        return name(
            panda[0], c_size_t(n), p[0], c_ssize_t(7), p[1], c_ssize_t(7), p[2], c_ssize_t(7), p[3], c_ssize_t(stride), 1
        ), library.ksl_error_message().decode()

    expected = ksl.load(PANDA).inverse_dynamics(q[: 7 * STATES].reshape(STATES, 7), zero, zero)
    assert run(q, out, 7)[0] == 0 and np.array_equal(out.reshape(STATES, 7), expected)
    assert run(q, out, 6) == (BAD_ARGUMENT, "tau: its rows have 7 numbers, and its stride is 6, so that they overlap; give a stride of 7 or more")
    assert run(q, out, -6)[0] == BAD_ARGUMENT and run(q, out[-7:], -7)[0] == 0 and run(q, out, 6, n=1)[0] == 0
    assert "tau overlaps q, which would be overwritten before it is read" in run(q, q[1:], 7)[1]
    copy = q.copy()
    assert run(copy, copy, 7)[0] == 0 and np.array_equal(copy[: 7 * STATES].reshape(STATES, 7), expected)  # in place, row by row
    records = np.zeros((STATES, 28))  # parts of one record are apart
    records[:, :7] = q[: 7 * STATES].reshape(STATES, 7)
    p = [c_void_p(records.ctypes.data + 8 * k) for k in (0, 7, 14, 21)]
    assert name(panda[0], c_size_t(STATES), p[0], c_ssize_t(28), p[1], c_ssize_t(28), p[2], c_ssize_t(28), p[3], c_ssize_t(28), 1) == 0
    assert np.array_equal(records[:, 21:], expected)


def test_one_state_refuses_the_same(library, panda):
    numbers, zero = np.linspace(0, 1, 32), np.zeros(7)
    p, z = numbers.ctypes.data, c_void_p(zero.ctypes.data)
    assert library.ksl_inverse_dynamics(*panda, c_void_p(p), z, z, None, c_void_p(p)) == 0
    assert library.ksl_inverse_dynamics(*panda, c_void_p(p), z, z, None, c_void_p(p + 8)) == BAD_ARGUMENT
    assert "tau overlaps q" in library.ksl_error_message().decode()


def test_inverse_kinematics_refuse_the_same(library, panda):
    frame = (c_double * 3)()
    ctypes.cast(frame, POINTER(c_int))[0] = 8
    frame[1] = frame[2] = 1.0
    targets, q, errors = np.tile(np.eye(4), (STATES, 1, 1)), np.zeros((STATES, 7)), np.zeros((STATES, 2))

    def run(q_at, q_stride, errors_at, errors_stride):
        t = c_void_p(targets.ctypes.data)
        return library.ksl_inverse_kinematics(
            panda[0], c_size_t(STATES), 1, frame, t, c_ssize_t(16), None, c_ssize_t(0), None, c_void_p(q_at), c_ssize_t(q_stride), c_void_p(errors_at),
            c_ssize_t(errors_stride), None, None, None, 1,
        )  # fmt: skip

    assert run(q.ctypes.data, 7, errors.ctypes.data, 2) == 0
    for given in (
        (q.ctypes.data, 6, errors.ctypes.data, 2),
        (q.ctypes.data, 7, errors.ctypes.data, 1),
        (targets.ctypes.data, 16, errors.ctypes.data, 2),
        (q.ctypes.data, 7, q.ctypes.data, 7),
    ):
        assert run(*given) == BAD_ARGUMENT, given


def test_hybrid_dynamics_refuse_links_of_fixed_joints(library, panda):
    numbers = [np.zeros(7) for _ in range(6)]
    p = [c_void_p(n.ctypes.data) for n in numbers]
    for link, status in ((0, BAD_ARGUMENT), (3, 0), (8, BAD_ARGUMENT)):
        found = library.ksl_hybrid_dynamics(*panda, *p[:4], None, 1, (c_int * 1)(link), *p[4:])
        assert found == status, (link, library.ksl_error_message())
        if status:
            assert "which is fixed and has no acceleration to be given" in library.ksl_error_message().decode()


MODES = {"x86_64": {"upward": 0x800, "downward": 0x400, "toward zero": 0xC00}, "aarch64": {"upward": 0x400000, "downward": 0x800000, "toward zero": 0xC00000}}
HERE = MODES.get(os.uname().machine, {})


@pytest.mark.skipif(not HERE, reason="modes have other numbers here")
def test_calls_round_to_nearest_whatever_the_mode_of_the_thread(library, panda):
    """Upward, torques at angles beyond 1e5 rad were wrong by 9.8 of 9.81 N m.  The mode is the thread's again after each call."""
    m = ksl.load(PANDA)
    rng = np.random.default_rng(5)
    q = rng.choice([1.0, 1e3, 2e5, 3e7, 1e12], (200, 7)) * rng.normal(size=(200, 7))
    v, a = rng.normal(size=(2, 200, 7))
    rng_screws, target = np.linspace(-3, 3, 60).reshape(10, 6), m.frame_pose(q[:3] % 1, "panda_flange")
    c = [np.ascontiguousarray(x[0]) for x in (q, v, a)]

    def of_c():
        out = np.empty(7)
        assert library.ksl_inverse_dynamics(*panda, *(c_void_p(x.ctypes.data) for x in c), None, c_void_p(out.ctypes.data)) == 0
        return out

    def of_c_batch():
        out = np.empty((200, 7))
        arguments = [y for x in (q, v, a, out) for y in (c_void_p(x.ctypes.data), c_ssize_t(7))]
        assert library.ksl_inverse_dynamics_batch(panda[0], c_size_t(200), *arguments, 0) == 0
        return out

    calls = {
        "one state": lambda: m.inverse_dynamics(q[0], v[0], a[0]), "batch": lambda: m.inverse_dynamics(q, v, a), "poses": lambda: m.frame_poses(q),
        "reactions": lambda: m.reactions(q, v, a), "forward": lambda: m.forward_dynamics(q, v, a), "regressor": lambda: m.inverse_dynamics_regressor(q, v, a),
        "inverse kinematics": lambda: m.inverse_kinematics("panda_flange", target).q,
        "loading": lambda: ksl.load(PANDA).parameters, "gravity": lambda: m.with_gravity((0.1, 0.2, -9.7)).inverse_dynamics(q, v, a),
        "simulation": lambda: m.simulate(q[0], 0 * v[0], [0, 0.01, 0.02]).q, "algebra": lambda: ufuncs.SE3_exp(rng_screws), "C": of_c, "C, batch": of_c_batch,
    }  # fmt: skip
    expected = {name: call() for name, call in calls.items()}
    libm = ctypes.CDLL("libm.so.6")
    for (name, call), (mode, number) in itertools.product(calls.items(), HERE.items()):
        assert libm.fesetround(number) == 0
        found = call()
        after = libm.fegetround()
        libm.fesetround(0)
        assert after == number, (name, mode)
        assert np.array_equal(found, expected[name]), (name, mode)


CANCELLED = r"""
#include <ksl/engine.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
enum { N = 2000 };
static ksl_model_t *m;
static double *x, *out;
static volatile int go;
static void *work(void *unused) { /* cancelled before its first batch: whatever waits in a batch would end it there */
  while (!go) continue;
  for (int k = 0; k < 200; ++k)
    ksl_inverse_dynamics_batch(m, N, x, 7, x, 7, x, 7, out, 7, 2);
  pthread_testcancel();
  return unused;
}
int main(int argc, char **argv) {
  if (argc < 2 || ksl_model_load(argv[1], NULL, &m)) return 2;
  x = calloc(7 * N, sizeof *x), out = malloc(7 * N * sizeof *out);
  for (int k = 0; k < 3; ++k) {
    pthread_t t;
    void *end;
    go = 0;
    pthread_create(&t, NULL, work, NULL);
    pthread_cancel(t);
    go = 1;
    pthread_join(t, &end);
    if (end != PTHREAD_CANCELED) return 3;
  }
  if (ksl_inverse_dynamics_batch(m, N, x, 7, x, 7, x, 7, out, 7, 2)) return 4;
  puts("goes on");
  return 0;
}
"""


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_a_thread_that_is_cancelled_in_a_batch_ends_alone(tmp_path):
    """The whole process ended."""
    source, program, library = tmp_path / "cancelled.c", tmp_path / "cancelled", Path(os.environ["KSL_LIBRARY"])
    source.write_text(CANCELLED)
    subprocess.run(["cc", "-O1", "-pthread", f"-I{ROOT / 'include'}", source, library, f"-Wl,-rpath,{library.parent}", "-o", program], check=True)
    done = subprocess.run([program, PANDA], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (0, "goes on\n"), done.stderr
