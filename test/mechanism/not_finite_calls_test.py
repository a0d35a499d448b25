"""NaN, infinities, subnormal numbers, flush-to-zero and decimal commas: what conventions.md promises, of every algorithm."""

import ctypes
import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from algorithms_test import ROWS, inputs, python

import ksl

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def robot(examples):
    return ksl.load(examples / "robots/panda.urdf", floating_base=True)


def numbers(row):
    return [row.called.get(name, name) for name in row.inputs]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("row", ROWS, ids=lambda r: r.name)
def test_a_number_that_is_not_finite_is_refused_by_name(robot, row, value):
    for leading in ((), (3,)):
        arguments = inputs(robot, row, *leading)
        for name in numbers(row):
            bad = np.array(arguments[name])
            bad[(-1,) * bad.ndim if bad.ndim else ()] = value
            with pytest.raises(ValueError, match=rf"{name}.* is -?(nan|inf)|{name}.*finite"):
                python(robot, row, arguments | {name: bad})
        if "external" in arguments:
            link, wrench = next(iter(arguments["external"].items()))
            with pytest.raises(ValueError, match="external.*(nan|inf)"):
                python(robot, row, arguments | {"external": {link: np.full_like(wrench, value)}})


@pytest.mark.parametrize("row", ROWS, ids=lambda r: r.name)
def test_subnormal_numbers_are_numbers(robot, row):
    for dtype in (np.float64, np.float32):
        arguments = inputs(robot, row, dtype=dtype)
        for name in numbers(row):
            if name.startswith("q"):  # which has a quaternion
                continue
            arguments[name] = np.full_like(arguments[name], np.finfo(dtype).smallest_subnormal * 3)
        assert all(np.isfinite(x).all() for x in python(robot, row, arguments))


def mode(set_to: int | None = None) -> int:
    """The control register MXCSR of this thread, by glibc's fegetenv: bits 6 and 15 are denormals-are-zero and flush-to-zero."""
    libm = ctypes.CDLL("libm.so.6")
    environment = (ctypes.c_uint32 * 8)()
    libm.fegetenv(environment)
    if set_to is not None:
        environment[7] = set_to
        libm.fesetenv(environment)
    return environment[7] & ~0x3F  # without what has happened


@pytest.mark.skipif(platform.machine() != "x86_64", reason="MXCSR is a register of x86-64")
@pytest.mark.parametrize("row", ROWS, ids=lambda r: r.name)
def test_a_mode_that_the_caller_sets_stays_and_ordinary_results_are_the_same_bits(robot, row):
    arguments = inputs(robot, row, 5)
    usual, expected = mode(), python(robot, row, arguments, threads=1)
    assert mode() == usual
    try:
        mode(usual | 0x8040)
        found = python(robot, row, arguments, threads=1)
        assert mode() == usual | 0x8040
    finally:
        mode(usual)
    for x, y in zip(found, expected, strict=True):
        assert np.array_equal(x, np.where(np.abs(y) < np.finfo(y.dtype).tiny, 0, y))


THREADS_AND_MODES = """
import ctypes, sys
import numpy as np, ksl
m = ksl.load(sys.argv[1], gravity=(0, 0, 0))
libm, environment = ctypes.CDLL("libm.so.6"), (ctypes.c_uint32 * 8)()
libm.fegetenv(environment)
environment[7] |= 0x8040
libm.fesetenv(environment)
zero = np.zeros((20000, m.nv))
print(np.count_nonzero(m.inverse_dynamics(zero, zero, zero + 1e-310, threads=2)))
"""


@pytest.mark.skipif(platform.machine() != "x86_64", reason="MXCSR is a register of x86-64")
def test_threads_of_batches_have_the_mode_of_the_thread_that_starts_them(examples):
    """In a process of its own, whose first batch is called in the mode: no thread computes with subnormal numbers."""
    done = subprocess.run([sys.executable, "-c", THREADS_AND_MODES, examples / "robots/panda.urdf"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "0\n"), done.stderr


@pytest.fixture(scope="module")
def with_commas(tmp_path_factory):
    """The environment of a process whose locale has decimal commas."""
    if not shutil.which("localedef") or not Path("/usr/share/i18n/locales/de_DE").exists():
        pytest.skip("localedef or the source of de_DE is not there")
    folder = tmp_path_factory.mktemp("locales")
    done = subprocess.run(["localedef", "-i", "de_DE", "-f", "UTF-8", folder / "de_DE.UTF-8"], capture_output=True, text=True)
    assert (folder / "de_DE.UTF-8" / "LC_NUMERIC").exists(), done.stderr
    return os.environ | {"LOCPATH": str(folder), "LC_ALL": "de_DE.UTF-8"}


SCRIPT = """
import ctypes, locale, sys
locale.setlocale(locale.LC_ALL, "de_DE.UTF-8")
text = ctypes.create_string_buffer(32)
ctypes.CDLL(None).snprintf(text, ctypes.c_size_t(32), b"%.2f", ctypes.c_double(0.25))
assert text.value == b"0,25", text.value  # C does print commas here
import numpy as np
import ksl
m = ksl.load(sys.argv[1])
print(m.joint(m.joint_names[0]).upper.hex(), np.array(m.mass_matrix(m.neutral())).tobytes().hex()[:200])
again = ksl.load_string(m.to_urdf())
assert "," not in m.to_urdf().replace(", ", "").split("<joint")[1], "decimal commas were written"
assert np.array_equal(again.mass_matrix(again.neutral()), m.mass_matrix(m.neutral()))
try:
    ksl.load_string(open(sys.argv[1]).read().replace('mass value="2', 'mass value="2,', 1).replace('<mass value="0.', '<mass value="0,', 1))
    print("taken")
except ValueError as error:
    print("refused")
"""


def test_a_locale_with_decimal_commas_changes_no_number(with_commas, examples):
    robot = str(examples / "robots/panda.urdf")
    done = subprocess.run([sys.executable, "-c", SCRIPT, robot], capture_output=True, text=True, env=with_commas)
    assert done.returncode == 0, done.stderr
    m = ksl.load(robot)
    own = f"{m.joint(m.joint_names[0]).upper.hex()} {np.array(m.mass_matrix(m.neutral())).tobytes().hex()[:200]}"
    assert done.stdout.splitlines() == [own, "refused"]


def test_the_command_writes_the_same_files(with_commas, examples, tmp_path):
    """Also reads them: a CSV file of a motion with decimal points."""
    texts = []
    for name, environment in (("points", dict(os.environ)), ("commas", with_commas)):
        out = tmp_path / name
        command = [sys.executable, "-m", "ksl", "loads", examples / "robots/panda.urdf", examples / "motions/panda_pick.csv", "-o", out]
        done = subprocess.run(list(map(str, command)), capture_output=True, text=True, env=environment)
        assert done.returncode == 0, done.stderr
        texts.append([line for line in (out / "summary.csv").read_text().splitlines() if not line.startswith("#")])
    assert texts[0] == texts[1]
