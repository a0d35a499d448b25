"""Arrays of any layout and protocol give the bits of plain ones, and what can't be read or written is refused."""

import os
import subprocess
import sys

import numpy as np
import pytest
from random_states import random_states

import ksl


def states(m, *leading):
    return random_states(m, np.random.default_rng(3), *leading)


def calls(m, q, v, a):
    """Every algorithm with its arguments."""
    return [
        (m.inverse_dynamics, (q, v, a)),
        (m.forward_dynamics, (q, v, a)),
        (m.mass_matrix, (q,)),
        (m.bias, (q, v)),
        (m.gravity_torque, (q,)),
        (m.reactions, (q, v, a)),
    ]


class Converted:
    """Has the array protocol and nothing else."""

    def __init__(self, x):
        self.x = x

    def __array__(self, dtype=None, copy=None):
        return self.x if dtype is None else self.x.astype(dtype)


class Exchanged:
    """Has DLPack and nothing else."""

    def __init__(self, x):
        self.x = x

    def __dlpack__(self, **options):
        return self.x.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.x.__dlpack_device__()


def misaligned(x):
    memory = np.zeros(x.nbytes + 1, np.uint8)
    y = memory[1:].view(x.dtype).reshape(x.shape)
    y[...] = x
    assert not y.flags.aligned
    return y


def spaced(x):
    """Rows apart, as columns of a wider array are."""
    return np.concatenate([x, np.full((*x.shape[:-1], 3), np.nan, x.dtype)], axis=-1)[..., : x.shape[-1]]


def read_only(x):
    y = x.copy()
    y.setflags(write=False)
    return y


LAYOUTS = {
    "misaligned": misaligned,
    "rows backwards": lambda x: x[::-1].copy()[::-1],
    "numbers backwards": lambda x: x[..., ::-1].copy()[..., ::-1],
    "rows apart": spaced,
    "rows apart and backwards": lambda x: spaced(x[::-1])[::-1],
    "numbers apart": lambda x: np.repeat(x, 2, axis=-1)[..., ::2],
    "columns": np.asfortranarray,
    "foreign byte order": lambda x: x.astype(x.dtype.newbyteorder()),
    "read-only": read_only,
    "array protocol": Converted,
    "DLPack": Exchanged,
    "buffer": memoryview,
    "lists": lambda x: x.tolist(),
}


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("leading", [(1,), (21,), (4, 3), (3, 1, 5)])
def test_layouts_make_no_difference(arm, layout, leading):
    plain = states(arm, *leading)
    for (call, given), (_, other) in zip(calls(arm, *plain), calls(arm, *map(LAYOUTS[layout], plain))):
        assert np.array_equal(call(*other), call(*given))
        for k in range(len(given)):
            assert np.array_equal(call(*given[:k], other[k], *given[k + 1 :]), call(*given))


@pytest.mark.parametrize("layout", [name for name in LAYOUTS if name != "lists"])
def test_single_precision_stays_in_any_layout(arm, layout):
    plain = [x.astype(np.float32) for x in states(arm, 21)]
    for (call, given), (_, other) in zip(calls(arm, *plain), calls(arm, *map(LAYOUTS[layout], plain))):
        found = call(*other)
        assert found.dtype == np.float32
        assert np.array_equal(found, call(*given))


@pytest.mark.parametrize("leading", [(0,), (3, 0), (0, 3)])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_no_states_keep_their_precision(arm, leading, dtype):
    """NumPy gives arrays without numbers strides of its own."""
    for call, given in calls(arm, *(np.zeros((*leading, n), dtype) for n in (arm.nq, arm.nv, arm.nv))):
        found = call(*given)
        assert found.dtype == dtype and found.shape[: len(leading)] == leading
        out = np.empty(found.shape, dtype)
        assert call(*given, out=out) is out
    mixed = arm.inverse_dynamics(np.zeros((*leading, arm.nq)), np.zeros(arm.nv, np.float32), np.zeros(arm.nv))
    assert mixed.dtype == np.float64 and mixed.shape == (*leading, arm.nv)


@pytest.mark.parametrize(
    "unfit", [misaligned, spaced, np.asfortranarray, read_only, lambda x: x.astype(np.float32), lambda x: x[1:], lambda x: x[..., None], memoryview]
)
def test_an_unfit_out_is_refused_by_every_call(arm, unfit):
    for call, given in calls(arm, *states(arm, 21)):
        out = unfit(call(*given))
        with pytest.raises(ValueError, match="out is .*expected a C-contiguous, aligned, writeable float64 array of shape"):
            call(*given, out=out)


def test_out_over_arguments_with_gaps(arm):
    """Such arguments are copied where the result would run over them."""
    v = states(arm, 21)[1]
    memory = np.zeros((42, arm.nv))
    memory[::2] = v
    given = list(states(arm, 21))
    expected = arm.inverse_dynamics(given[0], v, given[2])
    assert np.array_equal(arm.inverse_dynamics(given[0], memory[::2], given[2], out=memory[:21]), expected)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_numbers_that_are_not_finite_are_said_by_every_call(arm, bad, dtype):
    for n, at in ((1, 0), (40, 39), (9000, 8765)):
        plain = [x.astype(dtype) for x in states(arm, n)]
        for k, name in enumerate("qva"):
            given = [x.copy() for x in plain]
            given[k][at, 2] = bad
            for call, arguments in calls(arm, *given):
                if len(arguments) > k:
                    with pytest.raises(
                        ValueError, match=rf"{'tau' if k == 2 and call == arm.forward_dynamics else name}\[{at}, 2\] is {bad}; every number must be finite"
                    ):
                        call(*arguments)


def test_large_and_small_numbers_are_finite(arm):
    q, v, a = states(arm, 3)
    for x in (1e300, -1e300, np.finfo(float).tiny, 5e-324, -0.0):
        a[1, 2] = x
        assert np.isfinite(arm.inverse_dynamics(q, v, a)).all()
    for x in (np.finfo(float).max, -np.finfo(float).max):  # no argument is refused, but the efforts overflow
        a[1, 2] = x
        with pytest.raises(ksl.ResultError, match="although all arguments are finite"):
            arm.inverse_dynamics(q, v, a)


@pytest.mark.parametrize("n", [1, 3000])
@pytest.mark.parametrize(
    "length, fits", [(1 + 9e-7, None), (1 + 1.1e-6, True), (1 + 9.99e-3, True), (1 - 9.99e-3, True), (1 + 1.01e-2, False), (1 - 1.01e-2, False), (0, False)]
)
def test_quaternions_are_measured_by_every_call(examples, n, length, fits):
    m = ksl.load(examples / "robots/panda.urdf", floating_base=True)
    q, v, a = states(m, n)
    q[-1, 3:7] *= length
    for call, given in calls(m, q, v, a):
        if fits is None:
            call(*given)
        elif fits:
            with pytest.warns(ksl.QuaternionWarning, match=f"state {n - 1} .of floating_base. differs from unit length.*normalised") as warned:
                call(*given)
            assert warned[0].filename == __file__
        else:
            with pytest.raises(ValueError, match=rf"floating_base: quaternion of state {n - 1} has length"):
                call(*given)


@pytest.mark.parametrize("q", ["[0.0] * m.nq", "np.zeros(m.nq)", "np.zeros((100_000, m.nq))"])
def test_an_unknown_instruction_set_is_said_with_the_known_ones(examples, q):
    code = f"import sys, ksl, numpy as np; m = ksl.load(sys.argv[1]); m.gravity_torque({q}, threads=2)"
    run = subprocess.run(
        [sys.executable, "-c", code, examples / "robots/panda.urdf"], capture_output=True, text=True, env=os.environ | {"KSL_ISA": "x86-64-v9"}
    )
    assert run.returncode == 1 and run.stderr.splitlines()[-1].startswith("RuntimeError: ")
    assert "KSL_ISA=x86-64-v9 is no instruction set that runs here; known: " in run.stderr


def test_more_axes_than_a_result_can_have_are_refused(arm):
    """The result of an algorithm may have two axes more than its arguments, and NumPy has a largest number of axes."""
    most = 64 if np.lib.NumpyVersion(np.__version__) >= "2.0.0" else 32
    q = np.zeros((*[1] * (most - 1), arm.nq))
    if arm.nq != arm.nv:
        q[..., 6] = 1
    assert arm.gravity_torque(q).ndim == most
    for call in (arm.mass_matrix, arm.frame_poses):
        with pytest.raises(ValueError, match="dimension"):
            call(q)


def test_no_count_of_threads(arm):
    q = np.zeros((3, arm.nq)) if arm.nq == arm.nv else np.tile([0, 0, 0, 0, 0, 0, 1, *[0] * 7], (3, 1)).astype(float)
    with pytest.raises(ValueError, match="ambiguous"):
        arm.gravity_torque(q, threads=np.array([1, 2]))
    assert np.array_equal(arm.gravity_torque(q, threads=10**30), arm.gravity_torque(q))
