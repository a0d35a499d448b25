"""Efforts of inverse dynamics and their gradients in JAX and torch, beside other code for these and beside calls through jax.pure_callback.

    python bench/gradients.py [--states 4096] [--robot ROBOT.urdf] [--turns 31]

One core.  Each way computes tau, and the gradients of Σ weights · tau by q, v and a, in double precision, of the same states, in one compiled program; all
must agree to 1e-6 of the largest number.  They take turns; a figure is the median of their processor times.  Peers that aren't installed are left
out: pip install torch frax mujoco-mjx jaxsim adam-robotics.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ |= {"JAX_PLATFORMS": "cpu", "JAX_ENABLE_X64": "1", "OMP_NUM_THREADS": "1", "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false"}
if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})

import jax
import jax.numpy as jnp
import numpy as np

import ksl
import ksl.jax

ROOT = Path(__file__).resolve().parents[1]
Way = Callable[[jax.Array, jax.Array, jax.Array], jax.Array]


def callback(m: ksl.Model, gradient: bool) -> Way:
    """Inverse dynamics by jax.pure_callback: backward by the Jacobians, or by the call that gives the gradients."""
    shape = lambda x, *more: jax.ShapeDtypeStruct((*x.shape, *more), x.dtype)

    @jax.custom_vjp
    def tau(q, v, a):
        return jax.pure_callback(lambda *x: m.inverse_dynamics(*x, threads=1), shape(v), q, v, a)

    def by_jacobians(x, weights):
        matrices = jax.pure_callback(lambda *x: m.inverse_dynamics_derivatives(*x, threads=1), (shape(x[1], m.nv),) * 3, *x)
        return tuple(jnp.einsum("nik,ni->nk", each, weights) for each in matrices)

    def by_gradient(x, weights):
        return jax.pure_callback(lambda *x: m.inverse_dynamics_gradient(*x, threads=1), (shape(x[1]),) * 3, *x, weights)

    tau.defvjp(lambda q, v, a: (tau(q, v, a), (q, v, a)), by_gradient if gradient else by_jacobians)
    return tau


def of_array_rnea(m: ksl.Model, path: Path) -> Way:
    """The recursion over arrays of bench/array_rnea.py."""
    import array_rnea

    bodies = array_rnea.bodies_of(m)
    return lambda q, v, a: array_rnea.rnea(jnp, bodies, q, v, a)


def of_frax(m: ksl.Model, path: Path) -> Way:
    import frax

    robot = frax.Robot(str(path))
    gravity = jnp.array([0, 0, 9.81, 0, 0, 0])  # that of the ground, upwards
    return jax.vmap(lambda q, v, a: robot.rnea(q, v, a, gravity, None))


def of_mjx(m: ksl.Model, path: Path) -> Way:
    import mujoco
    from mujoco import mjx

    spec = mujoco.MjSpec.from_file(str(path))
    spec.compiler.discardvisual = True
    compiled = spec.compile()
    compiled.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT | mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS
    compiled.dof_damping[:] = 0
    compiled.dof_armature[:] = 0
    model = mjx.put_model(compiled)
    blank = mjx.make_data(model)

    def one(q, v, a):
        return mjx.inverse(model, blank.replace(qpos=q, qvel=v, qacc=a)).qfrc_inverse

    return jax.vmap(one)


def of_jaxsim(m: ksl.Model, path: Path) -> Way:
    import jaxsim.api as js

    model = js.model.JaxSimModel.build_from_model_description(path, considered_joints=tuple(m.joint_names), gravity=9.81)
    order = np.array([model.joint_names().index(name) for name in m.joint_names])
    back = np.argsort(order)

    def one(q, v, a):
        data = js.data.JaxSimModelData.build(model, joint_positions=q[back], joint_velocities=v[back])
        return js.model.inverse_dynamics(model, data, joint_accelerations=a[back], base_acceleration=jnp.zeros(6))[1][order]

    return jax.vmap(one)


def of_adam(m: ksl.Model, path: Path) -> Way:
    from adam.jax import KinDynComputations

    robot = KinDynComputations(str(path), list(m.joint_names), gravity=np.array([0, 0, -9.81, 0, 0, 0]))

    def batch(q, v, a):  # it takes batches itself, and vmap fails in it
        base = jnp.broadcast_to(jnp.eye(4), (len(q), 4, 4))
        return jnp.einsum("nij,nj->ni", robot.mass_matrix(base, q)[:, 6:, 6:], a) + robot.bias_force(base, q, jnp.zeros((len(q), 6)), v)[:, 6:]

    return batch


def in_torch(make: Callable[[ksl.Model, Path], Callable[..., Any]]) -> Callable[[ksl.Model, Path, list[jax.Array], jax.Array], Callable[..., list[np.ndarray]]]:
    """Efforts and gradients in torch, which runs no compiled program."""

    def program(m, path, x, weights):
        import torch

        torch.set_num_threads(1)
        tau = make(m, path)
        given = [torch.tensor(np.asarray(y), requires_grad=True) for y in x]
        w = torch.tensor(np.asarray(weights))

        def compute(*_):
            y = tau(*given)
            return [each.detach().numpy() for each in (y, *torch.autograd.grad(y, given, w))]

        return compute

    return program


def of_torch(m: ksl.Model, path: Path) -> Callable[..., Any]:
    import ksl.torch

    return ksl.torch.differentiable(m, threads=1).inverse_dynamics


def of_adam_torch(m: ksl.Model, path: Path) -> Callable[..., Any]:
    import torch
    from adam.pytorch import KinDynComputations

    robot = KinDynComputations(str(path), list(m.joint_names), dtype=torch.float64, gravity=torch.tensor([0, 0, -9.81, 0, 0, 0], dtype=torch.float64))

    def batch(q, v, a):
        base = torch.eye(4, dtype=q.dtype).expand(len(q), 4, 4)
        still = torch.zeros(len(q), 6, dtype=q.dtype)
        return torch.einsum("nij,nj->ni", robot.mass_matrix(base, q)[:, 6:, 6:], a) + robot.bias_force(base, q, still, v)[:, 6:]

    return batch


def both(tau: Way, weights: jax.Array) -> Callable[..., list[jax.Array]]:
    """Efforts and gradients in one program."""

    def compute(q, v, a):
        y, back = jax.vjp(tau, q, v, a)
        return [y, *back(weights)]

    return jax.jit(compute)


def ways(m: ksl.Model, path: Path) -> dict[str, Way]:
    found: dict[str, Way] = {
        "ksl.jax": ksl.jax.differentiable(m, threads=1).inverse_dynamics,
        "pure_callback, Jacobians": callback(m, gradient=False),
        "pure_callback, gradient": callback(m, gradient=True),
    }
    for name, make in {"frax": of_frax, "mjx": of_mjx, "jaxsim": of_jaxsim, "adam": of_adam, "array_rnea": of_array_rnea}.items():
        try:
            found[name] = make(m, path)
        except Exception as e:
            print(f"left out: {name}: {type(e).__name__}: {str(e).splitlines()[0] if str(e) else ''}", file=sys.stderr)
    return found


def measure(programs: dict[str, Callable[..., list[jax.Array]]], x: list[jax.Array], turns: int) -> dict[str, float]:
    """Median processor times, s."""
    times: dict[str, list[float]] = {name: [] for name in programs}
    for _ in range(turns):
        for name, program in programs.items():
            begin = time.process_time()
            jax.block_until_ready(program(*x))
            times[name].append(time.process_time() - begin)
    return {name: float(np.median(each)) for name, each in times.items()}


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--states", type=int, default=4096)
    options.add_argument("--robot", type=Path, default=ROOT / "examples/robots/panda.urdf")
    options.add_argument("--turns", type=int, default=31)
    given = options.parse_args()
    m = ksl.load(given.robot)
    rng = np.random.default_rng(0)
    x = [jnp.asarray(y) for y in (m.random(rng, size=given.states), *rng.normal(size=(2, given.states, m.nv)))]
    weights = jnp.asarray(rng.normal(size=(given.states, m.nv)))
    programs, expected = {}, None
    made = {name: lambda way=way: both(way, weights) for name, way in ways(m, given.robot).items()}
    for name, make in {"ksl.torch": of_torch, "adam, torch": of_adam_torch}.items():
        made[name] = lambda make=make: in_torch(make)(m, given.robot, x, weights)
    for name, make in made.items():
        try:
            program = make()
            found = jax.block_until_ready(program(*x))
        except Exception as e:
            print(f"left out: {name}: {type(e).__name__}: {str(e).splitlines()[0] if str(e) else ''}", file=sys.stderr)
            continue
        expected = [np.asarray(y) for y in found] if expected is None else expected
        error = max(float(np.abs(np.asarray(a) - b).max() / np.abs(b).max()) for a, b in zip(found, expected))
        if not error < 1e-6:
            print(f"left out: {name}: its results differ by {error:.1e} of the largest number", file=sys.stderr)
            continue
        programs[name] = program
    print(
        f"{m.name}, {given.states} states, {ksl.__version__} with {ksl._core.instruction_set()}, JAX {jax.__version__}; ms, and how many times that of ksl.jax"
    )
    times = measure(programs, x, given.turns)
    for name, seconds in times.items():
        print(f"{name:28}{1e3 * seconds:10.2f}{seconds / times['ksl.jax']:8.1f}")


if __name__ == "__main__":
    main()
