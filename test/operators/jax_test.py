"""ksl.jax: gradients of every operator in both directions, batches, programs, precision, and what is refused."""

import os
import pickle
import subprocess
import sys

import numpy as np
import pytest
import operator_cases
from operator_cases import CLOSED, PUSHED, along, closed_named, pushed, pushed_arguments, robot_named

os.environ.setdefault("JAX_PLATFORMS", "cpu")
jax = pytest.importorskip("jax", reason="needs JAX: pip install 'ksl[jax]'")
import jax.numpy as jnp
from jax.test_util import check_grads

import ksl.jax
from ksl.operators.table import ROWS


@pytest.fixture(autouse=True)
def double():
    """Double precision, as differences need it; JAX counts in single precision unless it is told."""
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", before)


def call_of(m, name):
    return operator_cases.call_of(ksl.jax.differentiable(m), name)


def given_to(m, name, parameters=False, n=2, seed=0):
    return [jnp.asarray(x) for x in operator_cases.given_to(m, ROWS[name], parameters, n, seed)]


@pytest.mark.parametrize("name", ROWS)
def test_gradients(robot, name):
    x = given_to(robot, name)
    order = 2 if ROWS[name].second else 1
    check_grads(call_of(robot, name), x, order=order, atol=1e-4, rtol=1e-4)


@pytest.mark.parametrize("name", [name for name in ROWS if ROWS[name].regressor])
def test_gradients_by_parameters(robot, name):
    x = given_to(robot, name, parameters=True)
    check_grads(call_of(robot, name), x, order=1, atol=1e-4, rtol=1e-4)


@pytest.mark.parametrize("name, axes, parameters", PUSHED)
def test_gradients_by_external_wrenches(robot, name, axes, parameters):
    f = pushed(getattr(ksl.jax.differentiable(robot), name), robot, axes, parameters)
    x = [jnp.asarray(each) for each in pushed_arguments(robot, name, parameters, np.random.default_rng(3))]
    check_grads(f, x, order=1, atol=1e-4, rtol=1e-4)
    maps = (0, 0, 0, 0, None) + (None,) * parameters
    np.testing.assert_array_equal(jax.jit(jax.vmap(f, in_axes=maps))(*x), f(*x))


@pytest.mark.parametrize("name", CLOSED)
def test_gradients_along_closed_mechanisms(name):
    """By the coordinates of drives: positions and motions that follow from them, and all that the mechanism's dynamics make of these."""
    c = closed_named(name)
    m, d = c.model, ksl.jax.differentiable(c.model)
    sure = m.reactions_unique(c.q, [*m.joint_names, *m.loop_names])
    q, v, a = c.motions(np.random.default_rng(0), 2)
    x = [jnp.asarray(each) for each in (q * (1.3 if name == "quaternions" else 1), v, a)]
    motion = along(d.close, d.consistent_velocity, d.consistent_acceleration, c.drives)

    def closed(q, v, a):
        q, v, a = motion(q, v, a)
        held = d.reactions(q, v, a, joints=[*m.joint_names, *m.loop_names], undetermined="nan")[..., sure]
        return q, v, a, d.inverse_dynamics(q, v, a), d.forward_dynamics(q, v, a), d.bias(q, v), held, d.frame_velocities(q, v)

    check_grads(closed, x, order=1, atol=1e-4, rtol=1e-4)
    for found, expected in zip(jax.jit(jax.vmap(closed))(*x), closed(*x)):
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)
    gradient = jax.jit(jax.grad(lambda q: (d.inverse_dynamics(d.close(q, c.drives), 0.0, 0.0) ** 2).sum()))(x[0])
    held = [i for each in c.drives for i in range(m.joint(each).q_index, m.joint(each).q_index + m.joint(each).nq)]
    assert (np.delete(gradient, held, axis=1) == 0).all() and np.isfinite(gradient).all()


def test_programs_that_refuse_states_of_closed_mechanisms():
    c = closed_named("four-bar")
    d = ksl.jax.differentiable(c.model)
    with pytest.raises(Exception, match="ksl: gravity_torque: state 0: loop joint closure is open at this position"):
        jax.block_until_ready(jax.jit(d.gravity_torque)(c.q + 0.1))
    with pytest.raises(NotImplementedError, match="gravity_torque: there are no second derivatives of it for mechanisms with loops"):
        jax.hessian(lambda q: d.gravity_torque(q).sum())(c.q)
    pin = lambda q: (d.reactions(d.close(q, c.drives), 0.0, 0.0, joints=["closure"])[..., :3] ** 2).sum()
    with pytest.raises(Exception, match="reactions: state 0: fy of joint closure is not determined by rigid bodies, and has no derivative"):
        jax.block_until_ready(jax.jit(jax.grad(pin))(c.q))
    in_plane = lambda q: (d.reactions(d.close(q, c.drives), 0.0, 0.0, joints=["closure"])[..., [0, 2]] ** 2).sum()
    assert (jax.grad(in_plane)(c.q) != 0).tolist() == [True, False, False]


def test_values_are_those_of_the_model(robot):
    q, v, a = (np.asarray(x) for x in given_to(robot, "inverse_dynamics", n=7))
    d = ksl.jax.differentiable(robot)
    unit = robot.integrate(q / 1.0, 0.0) if not any(j.quaternion is not None for j in robot.joints) else np.asarray(d.integrate(q, 0.0))
    np.testing.assert_allclose(d.inverse_dynamics(q, v, a), robot.inverse_dynamics(unit, v, a), rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(d.mass_matrix(q), robot.mass_matrix(unit), rtol=1e-11, atol=1e-12)
    assert d.kinetic_energy(q, v).shape == (7,) and d.frame_poses(q).shape == (7, len(robot.links), 4, 4)


def test_maps_and_programs():
    """vmap over any argument, over parameters too, inside and outside of jit, of grad, and of maps."""
    m = robot_named("floating")
    d = ksl.jax.differentiable(m)
    q, v, a = given_to(m, "inverse_dynamics", n=6)
    p = jnp.asarray(m.parameters) * jnp.linspace(0.9, 1.1, 6)[:, None, None]
    f = d.inverse_dynamics
    np.testing.assert_array_equal(jax.jit(jax.vmap(f))(q, v, a), f(q, v, a))
    np.testing.assert_array_equal(jax.vmap(f, in_axes=(None, 1, None), out_axes=1)(q[0], v.T, a[0]).T, f(q[0], v, a[0]))
    apart = jnp.stack([f(q[i], v[i], a[i], p[i]) for i in range(6)])
    np.testing.assert_array_equal(jax.vmap(f)(q, v, a, p), apart)
    np.testing.assert_array_equal(f(q, v, a, p), apart)
    cost = lambda q, v, a, p: (f(q, v, a, p) ** 2).sum()
    each = jax.vmap(jax.grad(cost, argnums=(0, 3)))(q, v, a, p)
    alone = [jax.grad(cost, argnums=(0, 3))(q[i], v[i], a[i], p[i]) for i in range(6)]
    for found, expected in zip(each, zip(*alone)):
        np.testing.assert_allclose(found, jnp.stack(expected), rtol=1e-12, atol=1e-12)
    shared = jax.vmap(jax.grad(cost, argnums=3), in_axes=(0, 0, 0, None))(q, v, a, p[0])
    np.testing.assert_allclose(shared.sum(0), jax.grad(cost, argnums=3)(q, v, a, p[0]), rtol=1e-10, atol=1e-10)
    nested = jax.vmap(jax.vmap(f, in_axes=(None, 0, None)), in_axes=(0, None, 0))(q, v, a)
    np.testing.assert_array_equal(nested[2, 4], f(q[2], v[4], a[2]))


def test_second_derivatives_in_all_directions():
    m = robot_named("physics")
    f = ksl.jax.differentiable(m).forward_dynamics
    x = [a[0] for a in given_to(m, "forward_dynamics")]
    expected = m.forward_dynamics_second_derivatives(*map(np.asarray, x))[2]  # by q and v
    for outer in (jax.jacfwd, jax.jacrev):
        for inner in (jax.jacfwd, jax.jacrev):
            np.testing.assert_allclose(outer(inner(f, 0), 1)(*x), expected, rtol=1e-9, atol=1e-9)


def test_gradients_along_joint_velocities(robot):
    """Those of the engine are the gradients by a displacement of the position."""
    d = ksl.jax.differentiable(robot)
    q, v, a = (x[0] for x in given_to(robot, "inverse_dynamics"))
    q = d.integrate(q, 0.0)  # of unit length
    weights = jnp.linspace(-1, 1, robot.nv)
    found = jax.grad(lambda dv: weights @ d.inverse_dynamics(d.integrate(q, dv), v, a))(jnp.zeros(robot.nv))
    np.testing.assert_allclose(found, robot.inverse_dynamics_gradient(*map(np.asarray, (q, v, a, weights)))[0], rtol=1e-10, atol=1e-10)
    by_numbers = jax.grad(lambda q: weights @ d.inverse_dynamics(q, v, a))(q)
    for j in robot.joints:
        if j.quaternion is not None and j.nq:
            part = slice(j.q_index + j.quaternion, j.q_index + j.quaternion + 4)
            assert abs(by_numbers[part] @ q[part]) < 1e-10 * abs(by_numbers).max()


def test_precision_and_numbers_for_all_coordinates():
    m = robot_named("physics")
    d = ksl.jax.differentiable(m)
    q, v, a = given_to(m, "inverse_dynamics", n=3)
    single = d.inverse_dynamics(*(x.astype(jnp.float32) for x in (q, v, a)))
    assert single.dtype == jnp.float32
    np.testing.assert_allclose(single, d.inverse_dynamics(q, v, a), rtol=1e-3, atol=1e-2)
    assert d.inverse_dynamics(q.astype(jnp.float32), 0.0, 0).dtype == jnp.float32
    np.testing.assert_array_equal(d.inverse_dynamics(q, 0.0, 0.0), d.gravity_torque(q))


def test_scans_and_gradients_through_them():
    """A simulation of ten steps, differentiated by its first velocity, against differences."""
    m = robot_named("every kind")
    d = ksl.jax.differentiable(m)

    def end(v0):
        def step(state, _):
            q, v = state
            v = v + 0.01 * d.forward_dynamics(q, v, 0.0)
            return (d.integrate(q, 0.01 * v), v), None

        (q, v), _ = jax.lax.scan(step, (jnp.asarray(m.neutral()), v0), None, length=10)
        return d.kinetic_energy(q, v) + d.potential_energy(q)

    v0 = given_to(m, "bias", n=1)[1][0] * 0.3
    check_grads(jax.jit(end), (v0,), order=1, atol=1e-4, rtol=1e-4)


def test_gradients_through_a_scan_of_a_closed_mechanism():
    """A simulation of ten steps of the crank's coordinate, after each of which the mechanism is closed, differentiated by where and how fast it begins."""
    c = closed_named("four-bar")
    d = ksl.jax.differentiable(c.model)

    def end(angle, speed):
        def step(state, _):
            q, v = state
            v = v + 0.01 * d.forward_dynamics(q, v, 0.0)
            q = d.close(d.integrate(q, 0.01 * v), c.drives)
            return (q, d.consistent_velocity(q, v, c.drives)), None

        q = d.close(jnp.asarray(c.q).at[0].set(angle), c.drives)
        v = d.consistent_velocity(q, jnp.zeros(3).at[0].set(speed), c.drives)
        (q, v), _ = jax.lax.scan(step, (q, v), None, length=10)
        return d.kinetic_energy(q, v) + d.potential_energy(q)

    check_grads(jax.jit(end), (c.q[0], 2.0), order=1, atol=1e-4, rtol=1e-4)


def test_what_is_refused():
    m = robot_named("physics")
    d = ksl.jax.differentiable(m)
    q, v, a = given_to(m, "inverse_dynamics")
    with pytest.raises(
        TypeError, match="inverse_dynamics: arguments have different types: q float64, v float32, a float64; give all float32 or all float64, by x.astype"
    ):
        d.inverse_dynamics(q, v.astype(jnp.float32), a)
    with pytest.raises(TypeError, match="expected float32 or float64"):
        d.gravity_torque(q.astype(jnp.float16))
    with pytest.raises(TypeError, match="expected float32 or float64"):
        d.gravity_torque(jnp.zeros(6, int))
    with pytest.raises(ValueError, match=r"gravity_torque: q has shape \(2, 5\); expected \(…, 6\): nq numbers for each state"):
        jax.jit(d.gravity_torque)(q[:, :5])
    with pytest.raises(
        TypeError, match="reactions: at is an array that is differentiated or traced, and there is no derivative by it; give three plain numbers"
    ):
        jax.grad(lambda at: d.reactions(q, v, a, at=at).sum())(jnp.zeros(3))
    with pytest.raises(NotImplementedError, match="reactions: there are no second derivatives of it"):
        jax.hessian(lambda q: d.reactions(q, v, a).sum())(q)
    with pytest.raises(NotImplementedError, match="inverse_dynamics: there are no third derivatives of it"):
        jax.jacfwd(jax.hessian(lambda q: d.inverse_dynamics(q, v, a).sum()))(q)
    with pytest.raises(NotImplementedError, match="there are no second derivatives of it with parameters="):
        jax.hessian(lambda q: d.inverse_dynamics(q, v, a, m.parameters).sum())(q)
    with pytest.raises(TypeError, match="expected a ksl.Model, as ksl.load returns it, and not str"):
        ksl.jax.differentiable("robot.urdf")
    with pytest.raises(ValueError, match="threads=-1; expected how many threads"):
        ksl.jax.differentiable(m, threads=-1)
    negative = jnp.asarray(m.parameters).at[3, 0].set(-1.0)
    with pytest.raises(Exception, match=f"ksl: link {m.link_names[3]}: "):
        jax.block_until_ready(d.inverse_dynamics(q, v, a, negative))


def test_what_becomes_an_array_and_what_does_not():
    m = robot_named("physics")
    d = ksl.jax.differentiable(m)
    q, tip, other = jnp.zeros(6), m.link_names[-1], m.link_names[2]
    numbers = np.linspace(-1, 1, 6)
    np.testing.assert_array_equal(d.gravity_torque(numbers.astype(">f8")), d.gravity_torque(numbers))
    np.testing.assert_array_equal(d.gravity_torque([0] * 6), d.gravity_torque(q))
    by_force = jax.grad(lambda f: d.inverse_dynamics(q, 0.0, 0.0, external={tip: [f, 0, 0, 0, 0, 0]}).sum())(1.0)
    np.testing.assert_allclose(
        by_force, m.inverse_dynamics(*[np.zeros(6)] * 3, external={tip: np.eye(6)[0]}).sum() - m.gravity_torque(np.zeros(6)).sum(), rtol=1e-9, atol=1e-9
    )
    for given in ((q,), (q, jnp.asarray(m.parameters))):
        assert jax.vmap(jax.grad(lambda *x: d.gravity_torque(*x).sum()))(*(x[None][:0] for x in given)).shape == (0, 6)
    pushed = lambda *wrenches: d.inverse_dynamics(q, 0.0, 0.0, external=dict(zip((tip, other), wrenches)))
    for call, said in (
        (lambda: d.gravity_torque("joints"), "gravity_torque: q is 'joints'; expected numbers"),
        (lambda: pushed(None), rf"external\['{tip}'\] is None; expected numbers"),
        (lambda: pushed(q, q.astype(jnp.float32)), rf"different types: external\['{tip}'\] float64, external\['{other}'\] float32"),
        (lambda: pushed(jnp.zeros((5, 6)), jnp.zeros((4, 6))), rf"leading shapes don't broadcast: external\['{tip}'\] \(5, 6\), external\['{other}'\] \(4, 6\)"),
        (lambda: jax.grad(lambda x: d.reactions(q, 0.0, 0.0, at=(x, 0.0, 0.0)).sum())(0.0), "reactions: at is an array that is differentiated or traced"),
        (lambda: jax.jit(m.gravity_torque)(q), r"q is differentiated or traced by torch or JAX, .*ksl.jax.differentiable\(model\)"),
    ):  # fmt: skip
        with pytest.raises((ValueError, TypeError), match=said):
            call()


def test_numbers_that_no_device_has_come_to_the_processor(monkeypatch):
    """Where JAX would put them on an accelerator."""
    m = robot_named("physics")
    d = ksl.jax.differentiable(m)
    q, single = np.linspace(-1, 1, 12).reshape(2, 6), np.float32
    calls = [
        lambda: d.inverse_dynamics(q, 0.5, [0] * 6),
        lambda: d.inverse_dynamics(q.astype(single), 0.5, 1),
        lambda: jax.grad(lambda x: d.gravity_torque(x).sum())(q[0]),
    ]
    calls.append(lambda: d.inverse_dynamics(jnp.asarray(q), 0.5, q, external={m.link_names[-1]: np.arange(6.0)}))
    here = [call() for call in calls]
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")
    for before, call in zip(here, calls):
        after = call()
        assert after.dtype == before.dtype and {x.platform for x in after.devices()} == {"cpu"}
        np.testing.assert_array_equal(after, before)


def test_a_program_for_another_device_is_refused_when_it_is_compiled():
    m = robot_named("physics")
    d = ksl.jax.differentiable(m)
    with pytest.raises(ValueError, match="gravity_torque: the program is for tpu, which KSL can't reach; give jax.jit arrays on jax.devices"):
        jax.jit(d.gravity_torque).trace(jnp.zeros(6)).lower(lowering_platforms=("tpu",))


def test_a_program_for_another_process_is_refused_when_it_is_exported():
    """What goes there instead is the model, and the function is compiled from it."""
    export = pytest.importorskip("jax.export", reason="JAX 0.5 needs absl-py for it")

    m = robot_named("physics")
    d = ksl.jax.differentiable(m)
    with pytest.raises(NotImplementedError, match="gravity_torque: jax.export writes programs for other processes.*pickle what ksl.jax.differentiable returns"):
        export.export(jax.jit(d.gravity_torque))(jnp.zeros(6))
    there = pickle.loads(pickle.dumps(d))
    np.testing.assert_array_equal(jax.jit(there.gravity_torque)(jnp.zeros(6)), m.gravity_torque(np.zeros(6)))


def test_programs_outlive_the_calls_that_they_are_made_of():
    m = robot_named("physics")
    program = jax.jit(ksl.jax.differentiable(m).gravity_torque).lower(jnp.zeros(6)).compile()
    import gc

    gc.collect()
    np.testing.assert_array_equal(program(jnp.zeros(6)), m.gravity_torque(np.zeros(6)))


def test_a_program_of_another_process_is_refused():
    """Its operator has a number that is unknown here; and so are calls that don't fit an operator."""
    m = robot_named("physics")
    d = ksl.jax.differentiable(m)
    d.gravity_torque(jnp.zeros(6))
    ((operator, _),) = d._kept.values()
    call = jax.ffi.ffi_call("ksl_operator", jax.ShapeDtypeStruct((1, 2, 6), jnp.float64))
    q = jnp.zeros((1, 2, 6))
    constants = {"operator": np.int64(operator.number), "stage": np.int64(0), "threads": np.int64(1)}
    np.testing.assert_array_equal(call(q, **constants)[0, 0], m.gravity_torque(np.zeros(6)))
    for given, wrong, said in (
        (q, {"operator": np.int64(1)}, "ksl: the model of this compiled function is of another process, or is gone; compile the function here"),
        (q, {"stage": np.int64(1)}, "ksl: arguments don't fit the operator"),
        (q, {"stage": np.int64(5)}, "ksl: there is no stage of this number"),
        (q[..., :5], {}, "ksl: arguments don't fit the operator"),
        (q[0], {}, "ksl: arguments don't fit the operator"),
        (q.astype(jnp.float32), {}, "ksl: arrays of different precision"),
        (q.astype(jnp.int32), {}, "ksl: arrays are neither float32 nor float64"),
        (q, {"stage": np.float64(0.5)}, "ksl: the call has no whole number stage"),
    ):
        with pytest.raises(Exception, match=said):
            jax.block_until_ready(call(given, **(constants | wrong)))


def test_without_jax_the_command_that_brings_it_is_named():
    code = "import sys\nsys.modules['jax'] = None\ntry:\n    import ksl.jax\nexcept ModuleNotFoundError as e:\n    print(e)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "ksl.jax needs JAX; install it with: pip install 'ksl[jax]'\n", done.stderr
