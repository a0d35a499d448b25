"""The kernel of many steps goes where `m.simulate` goes with the same method and step."""

import ctypes

import numpy as np
import pytest
from generated_code import EXAMPLES, FOLLOWED, run
from on_host import FLAGS, HERE, compiler

import ksl
from ksl.base.errors import ArgumentError
from ksl.generation.cuda import simulation

N, STEPS, H = 70, 40, 1e-3


def simulated(m, folder, scalar, asked, inputs, sizes, arguments=()):
    """q and v after some steps.  inputs: arrays and strides between rows, tau's with the numbers between steps besides."""
    return kernel(m, folder, scalar, asked, sizes, arguments=arguments)(inputs)


def kernel(m, folder, scalar, asked, sizes, **options):
    """The kernel as a call with such inputs, and a number of steps."""
    ksl.generate(m, asked, folder, name="p", scalar=scalar, cuda=True, **options)
    declared = next(line for line in (folder / "p.cuh").read_text().splitlines() if "void p_simulate(" in line)
    typed = declared.partition("p_simulate(")[2].rstrip(");")
    given = ", ".join(part.split()[-1].lstrip("*") for part in typed.split(","))
    call = f'extern "C" void run_it({typed}) {{ on_host::grid((unsigned)((n + P_SIMULATE_THREADS - 1) / P_SIMULATE_THREADS), P_SIMULATE_THREADS, [&] {{ p_simulate({given}); }}); }}\n'
    (folder / "all.cpp").write_text('#include "on_host.hpp"\n#include "p.cu"\n' + call)
    run(compiler(), *FLAGS, "-Wno-unused-function", f"-I{HERE}", "all.cpp", "-o", "all.so", cwd=folder)
    library, real = ctypes.CDLL(str(folder / "all.so")), ctypes.c_double if scalar == "double" else ctypes.c_float

    def go(inputs, steps=STEPS):
        out = [np.full((len(inputs[0][0]), size), np.nan, inputs[0][0].dtype) for size in sizes]
        words = [word for x in (*inputs, *((x, x.shape[1]) for x in out)) for word in (ctypes.c_void_p(x[0].ctypes.data), *map(ctypes.c_longlong, x[1:]))]
        library.run_it(ctypes.c_longlong(len(inputs[0][0])), ctypes.c_longlong(steps), real(H), *words)
        return out

    return go


def start(m):
    rng = np.random.default_rng(1)
    return np.stack([m.random(k) for k in range(N)]), rng.normal(size=(N, m.nv)), 5 * rng.normal(size=(N, m.nv))


def by_the_engine(m, q, v, tau):
    s = m.simulate(q, v, [0, STEPS * H], efforts=tau, method="semi_implicit_euler", step=H)
    return s.q[..., -1, :], s.v[..., -1, :]


@pytest.mark.parametrize("robot", ["ur5", "followed"])
def test_it_has_the_bits_of_simulate(ur5, tmp_path, robot):
    m = ur5 if robot == "ur5" else ksl.load_string(FOLLOWED)
    q, v, tau = start(m)
    found = simulated(m, tmp_path, "double", ["forward_dynamics"], [(q, m.nq), (v, m.nv), (tau, m.nv, 0)], (m.nq, m.nv))
    for k in (0, 31, 32, N - 1):
        for x, y in zip(found, by_the_engine(m, q[k], v[k], tau[k])):
            assert np.array_equal(x[k], y) and not np.allclose(y, q[k] if y is found[0] else 0)


def test_efforts_of_each_step_and_a_gravity_of_all(ur5, tmp_path):
    q, v, _ = start(ur5)
    tau, gravity = np.random.default_rng(2).normal(size=(N, STEPS, 6)), np.array([[0.5, 1.0, -1.6]])
    q1, v1 = simulated(ur5, tmp_path, "double", ["forward_dynamics"], [(q, 6), (v, 6), (tau, STEPS * 6, 6), (gravity, 0)], (6, 6), ["gravity"])
    lighter = ur5.with_gravity(gravity[0])
    for k in range(STEPS):
        v = v + H * lighter.forward_dynamics(q, v, tau[:, k])
        q = q + H * v
    assert np.array_equal(q1, q) and np.array_equal(v1, v)


def test_joints_with_several_coordinates_and_single_precision(tmp_path):
    m = ksl.load(EXAMPLES / "ur5.urdf", floating_base=True)
    q, v, tau = start(m)
    expected = [by_the_engine(m, q[k], v[k], tau[k]) for k in range(3)]
    for scalar, bound in (("double", 1e-11), ("float", 2e-3)):
        given = [np.ascontiguousarray(x, np.float64 if scalar == "double" else np.float32) for x in (q, v, tau)]
        q1, v1 = simulated(
            m, tmp_path / scalar, scalar, ["forward_dynamics", "integrate"], [(given[0], m.nq), (given[1], m.nv), (given[2], m.nv, 0)], (m.nq, m.nv)
        )
        for k, (x, y) in enumerate(expected):
            assert np.abs(q1[k] - x).max() < bound * np.abs(x).max() and np.abs(v1[k] - y).max() < bound * np.abs(y).max()
    ksl.generate(m, ["forward_dynamics"], tmp_path / "without", name="p", cuda=True)
    assert "simulate" not in (tmp_path / "without" / "p.cuh").read_text()  # nothing moves quaternions


@pytest.mark.parametrize(
    ("robot", "within"), [("excavator", 1e-12), ("two_rod_ankle", 1e-8)]
)  # that of the second differs by the square of how far a step opens loops
@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_closed_mechanisms_go_where_simulate_goes_or_end_in_nan(tmp_path, robot, within):
    m, rng = ksl.load(EXAMPLES / f"{robot}.urdf"), np.random.default_rng(1)
    flat = robot == "excavator"
    go = kernel(m, tmp_path, "double", ["forward_dynamics"] if flat else ["forward_dynamics", "integrate"], (m.nq, m.nv), pivots=flat)
    q = np.repeat(m.close(m.neutral()).q[None], 33, axis=0)
    free = m.independent(q[0])
    v = np.stack([m.consistent_velocity(x, 0.1 * rng.normal(size=m.nv), given=free) for x in q])
    tau = np.zeros((33, m.nv))
    tau[:, free[0]] = rng.normal(size=33)
    q[5, 0] += 0.1  # open
    v[6, 0] += 1.0  # opening
    tau[7] = 1e9
    q1, v1 = go([(q, m.nq), (v, m.nv), (tau, m.nv, 0)])
    assert np.flatnonzero(np.isnan(q1).any(axis=1)).tolist() == np.flatnonzero(np.isnan(v1).all(axis=1)).tolist() == [5, 6, 7]
    for k in (0, 31, 32):
        for x, y in zip((q1, v1), by_the_engine(m, q[k], v[k], tau[k])):
            assert np.allclose(x[k], y, rtol=0, atol=within * np.abs(y).max())
    kept = [k for k in range(33) if not np.isnan(q1[k, 0])]
    assert np.abs(m.loop_error(q1[kept])).max() < 1e-11 and np.abs(q1[kept] - q[kept]).max() > 1e-3
    for _ in range(STEPS):  # efforts may change between launches of one step each
        q, v = go([(q, m.nq), (v, m.nv), (tau, m.nv, 0)], steps=1)
    assert np.array_equal(q, q1, equal_nan=True) and np.array_equal(v, v1, equal_nan=True)


def test_why_a_closed_mechanism_has_no_kernel_of_many_steps_is_said(tmp_path, monkeypatch):
    m = ksl.load(EXAMPLES / "excavator.urdf")

    def refused(*_):
        raise ArgumentError("equations are not found")

    monkeypatch.setattr(simulation, "open_states", refused)
    ksl.generate(m, ["forward_dynamics"], tmp_path, name="p", cuda=True)
    assert "simulate" not in (tmp_path / "p.cuh").read_text() and "no kernel of many steps: equations are not found." in (tmp_path / "README.md").read_text()
