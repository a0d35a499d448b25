"""ksl.torch: gradients of every operator in both directions, batches, compiled graphs, precision, and what is refused."""

import copy
import pickle
import re
import subprocess
import sys

import numpy as np
import pytest
import operator_cases
from operator_cases import CLOSED, PUSHED, along, closed_named, pushed, pushed_arguments, robot_named

torch = pytest.importorskip("torch", reason="needs torch: pip install 'ksl[torch]'")
from torch.autograd import gradcheck, gradgradcheck
from torch.autograd import forward_ad

import ksl.torch
from ksl.operators.table import ROWS


def call_of(m, name):
    return operator_cases.call_of(ksl.torch.differentiable(m), name)


def given_to(m, name, parameters=False, n=2, seed=0, requires_grad=True):
    return tuple(torch.tensor(x, requires_grad=requires_grad) for x in operator_cases.given_to(m, ROWS[name], parameters, n, seed))


@pytest.mark.parametrize("name", ROWS)
def test_gradients(robot, name):
    x = given_to(robot, name)
    one, several = call_of(robot, name)(*(each[0] for each in x)), call_of(robot, name)(*x)
    torch.testing.assert_close(one, several[0], rtol=0, atol=0)
    assert gradcheck(call_of(robot, name), x, check_forward_ad=True, atol=1e-4, rtol=1e-4)
    if ROWS[name].second:
        assert gradgradcheck(call_of(robot, name), x, check_fwd_over_rev=True, check_rev_over_rev=True, atol=1e-4, rtol=1e-4)


@pytest.mark.parametrize("name", [name for name in ROWS if ROWS[name].regressor])
def test_gradients_by_parameters(robot, name):
    x = given_to(robot, name, parameters=True)
    assert gradcheck(call_of(robot, name), x, check_forward_ad=True, atol=1e-4, rtol=1e-4)


@pytest.mark.parametrize("name, axes, parameters", PUSHED)
def test_gradients_by_external_wrenches(robot, name, axes, parameters):
    d = ksl.torch.differentiable(robot)
    x = [torch.tensor(each, requires_grad=True) for each in pushed_arguments(robot, name, parameters, np.random.default_rng(3))]
    f = pushed(getattr(d, name), robot, axes, parameters)
    assert gradcheck(f, x, check_forward_ad=True, atol=1e-4, rtol=1e-4)
    q, *rest = (each.detach().numpy() for each in x[:5])
    if not parameters:
        links = (robot.link_names[-1], robot.link_names[2])
        expected = getattr(robot, name)(
            d.integrate(torch.tensor(q), 0.0).numpy(), *rest[:2], external=dict(zip(links, (rest[2], np.tile(rest[3], (2, 1))))), external_axes=axes
        )
        np.testing.assert_allclose(f(*x).detach(), expected, rtol=1e-11, atol=1e-11)
    mapped = torch.func.vmap(f, in_dims=(0, 0, 0, 0, None) + (None,) * parameters)(*(each.detach() for each in x))
    torch.testing.assert_close(mapped, f(*x).detach(), rtol=0, atol=0)
    with pytest.raises(NotImplementedError, match=r"no second derivatives of it with (parameters|external)="):
        torch.autograd.grad(torch.autograd.grad(f(*x).sum(), x[0], create_graph=True)[0].sum(), x[0])


@pytest.mark.parametrize("name", CLOSED)
def test_gradients_along_closed_mechanisms(name):
    """By the coordinates of drives: positions and motions that follow from them, and all that the mechanism's dynamics make of these."""
    c = closed_named(name)
    m, d = c.model, ksl.torch.differentiable(c.model)
    sure = torch.tensor(m.reactions_unique(c.q, [*m.joint_names, *m.loop_names]))
    q, v, a = c.motions(np.random.default_rng(0), 1 if name == "Stewart platform" else 2)
    q = q * (1.3 if name == "quaternions" else 1)
    x = tuple(torch.tensor(each, requires_grad=True) for each in (q, v, a))
    p, f = torch.tensor(m.parameters + 0.05, requires_grad=True), torch.linspace(-1, 1, 6, dtype=torch.float64, requires_grad=True)
    motion = along(d.close, d.consistent_velocity, d.consistent_acceleration, c.drives)

    def closed(q, v, a):
        q, v, a = motion(q, v, a)
        held = d.reactions(q, v, a, joints=[*m.joint_names, *m.loop_names], undetermined="nan")[..., sure]
        return q, v, a, d.inverse_dynamics(q, v, a), d.bias(q, v), d.gravity_torque(q), held, d.frame_velocities(q, v)

    def forced(q, v, a, p, f):
        q, v, tau = motion(q, v, a)
        wrench = {m.link_names[-1]: f}
        return d.forward_dynamics(q, v, tau, p, external=wrench), d.inverse_dynamics(q, v, tau, p, external=wrench, external_axes="world")

    assert gradcheck(closed, x, check_forward_ad=True, atol=1e-4, rtol=1e-4)
    assert gradcheck(forced, (*x, p, f), check_forward_ad=True, fast_mode=True, atol=1e-3, rtol=1e-4)
    plain = [each.detach() for each in x]
    for found, expected in zip(torch.func.vmap(closed)(*plain), closed(*plain)):
        torch.testing.assert_close(found, expected, rtol=1e-12, atol=1e-12)
    single = [each.float() for each in plain]
    for found, expected in zip(closed(*single), closed(*plain)):
        assert found.dtype == torch.float32 and (found - expected).abs().max() < 2e-3 * expected.abs().max().clamp(1)


def test_descent_along_a_closed_mechanism():
    """A Stewart platform finds the legs of a pose, by Newton's method; its gradient leaves passive coordinates alone, and is the same compiled."""
    c = closed_named("Stewart platform")
    m, d = c.model, ksl.torch.differentiable(c.model)
    start = torch.tensor(c.q)
    legs = torch.tensor([m.joint(name).q_index for name in c.drives])
    goal = d.frame_poses(torch.tensor(c.near(np.random.default_rng(1), 1)[0]), ["platform"])
    miss = lambda q: (d.frame_poses(d.close(q, c.drives), ["platform"]) - goal).square().sum()
    q = start.clone().requires_grad_()
    (gradient,) = torch.autograd.grad(miss(q), q)
    passive = torch.ones(m.nq, dtype=torch.bool).index_fill(0, legs, False)
    assert (gradient[passive] == 0).all() and (gradient[legs] != 0).all()
    (compiled,) = torch.autograd.grad(torch.compile(miss, fullgraph=True, backend="aot_eager")(q), q)
    torch.testing.assert_close(compiled, gradient, rtol=1e-12, atol=1e-12)
    missed = lambda strokes: (d.frame_poses(d.close(start.index_copy(0, legs, strokes), c.drives), ["platform"]) - goal).flatten()
    strokes = start[legs]
    for _ in range(5):
        strokes = strokes - torch.linalg.lstsq(torch.func.jacrev(missed)(strokes), missed(strokes)).solution
    assert missed(strokes).abs().max() < 1e-11 < 1e-2 < (strokes - start[legs]).abs().max()
    # The other way round, a pose with a quaternion of any length is given, and the legs follow; efforts know the coordinates of drives alone.
    needed = lambda pose: (
        (whole := d.close(torch.cat([pose, start[7:]]), ["free"]))[legs] * d.gravity_torque(whole)[[m.joint(name).v_index for name in c.drives]]
    )
    assert gradcheck(
        needed,
        (torch.cat([start[:3], torch.tensor([0.1, -0.2, 0.3, 1.2], dtype=torch.float64)]).requires_grad_(),),
        check_forward_ad=True,
        atol=1e-4,
        rtol=1e-4,
    )
    with pytest.raises(NotImplementedError, match="there are no second derivatives of it"):
        torch.func.hessian(miss)(start)
    with pytest.raises(ksl.ResultError, match="gravity_torque: state 0: loop joint S0 is open at this position by .* close"):
        d.gravity_torque(start + 0.1)


def test_wrenches_and_parameters_that_do_not_fit():
    m = robot_named("floating")
    d = ksl.torch.differentiable(m)
    q, v, a = given_to(m, "inverse_dynamics", requires_grad=False)
    tip = m.link_names[-1]
    with pytest.raises(ValueError, match=rf"inverse_dynamics: external\['{tip}'\] has shape \(2, 3\); expected \(…, 6\): force, then moment"):
        d.inverse_dynamics(q, v, a, external={tip: torch.zeros(2, 3)})
    with pytest.raises(ValueError, match="no link|nobody"):
        d.inverse_dynamics(q, v, a, external={"nobody": torch.zeros(6, dtype=q.dtype)})
    for parameters, said in (
        ({tip: torch.zeros(2, 3)}, rf"inverse_dynamics: parameters\['{tip}'\] has shape \(2, 3\); expected \(…, 10\): m, m c, Ixx"),
        ({"nobody": torch.zeros(10, dtype=q.dtype)}, "nobody"),
        ({}, "inverse_dynamics: parameters names no link"),
    ):
        with pytest.raises(ValueError, match=said):
            d.inverse_dynamics(q, v, a, parameters)
    with pytest.raises(ValueError, match="external_axes='here'"):
        d.inverse_dynamics(q, v, a, external={tip: torch.zeros(6, dtype=q.dtype)}, external_axes="here")
    with pytest.raises(TypeError, match=r"different types: .*external torch.float32"):
        d.inverse_dynamics(q, v, a, external={tip: torch.zeros(6)})
    torch.testing.assert_close(d.inverse_dynamics(q, v, a, external={tip: [0.0] * 6}), d.inverse_dynamics(q, v, a), rtol=0, atol=0)
    torch.testing.assert_close(d.inverse_dynamics(q, v, a, external={}), d.inverse_dynamics(q, v, a), rtol=0, atol=0)


def test_functions_of_functions():
    """torch.func: maps over any argument, over parameters too, and second derivatives in all directions."""
    m = robot_named("floating")
    d = ksl.torch.differentiable(m)
    q, v, a = given_to(m, "inverse_dynamics", n=5, requires_grad=False)
    p = torch.tensor(m.parameters) * torch.linspace(0.9, 1.1, 5)[:, None, None]
    f, func = d.inverse_dynamics, torch.func
    torch.testing.assert_close(func.vmap(f)(q, v, a), f(q, v, a), rtol=0, atol=0)
    torch.testing.assert_close(func.vmap(f, in_dims=(None, 1, None), out_dims=1)(q[0], v.T, a[0]).T, f(q[0], v, a[0]), rtol=0, atol=0)
    apart = torch.stack([f(q[i], v[i], a[i], p[i]) for i in range(5)])
    torch.testing.assert_close(func.vmap(f)(q, v, a, p), apart, rtol=0, atol=0)
    torch.testing.assert_close(f(q, v, a, p), apart, rtol=0, atol=0)
    twofold = lambda x: torch.stack([x, -x], dim=1)
    torch.testing.assert_close(
        func.vmap(func.vmap(f))(*map(twofold, (q, v, a)), torch.stack([p, p], dim=1)), torch.stack([apart, f(-q, -v, -a, p)], dim=1), rtol=0, atol=0
    )
    cost = lambda q, v, a, p: (f(q, v, a, p) ** 2).sum()
    for given in ((q, v, a), (q, v, a, p)):
        assert func.vmap(func.grad(lambda q, *x: f(q, *x).sum()))(*(x[:0] for x in given)).shape == (0, m.nq)
    shared = func.vmap(func.grad(cost, argnums=3), in_dims=(0, 0, 0, None))(q, v, a, p[0])
    torch.testing.assert_close(shared.sum(0), func.grad(cost, argnums=3)(q, v, a, p[0]), rtol=1e-10, atol=1e-10)
    of = lambda q, v: d.forward_dynamics(q, v, a[0])
    expected = func.jacfwd(func.jacfwd(of, 0), 1)(q[0], v[0])
    for outer in (func.jacfwd, func.jacrev):
        for inner in (func.jacfwd, func.jacrev):
            torch.testing.assert_close(outer(inner(of, 0), 1)(q[0], v[0]), expected, rtol=1e-9, atol=1e-9)


def test_forward_mode():
    m = robot_named("physics")
    d = ksl.torch.differentiable(m)
    q, v, a = given_to(m, "inverse_dynamics", requires_grad=False)
    with forward_ad.dual_level():
        found = forward_ad.unpack_dual(d.inverse_dynamics(forward_ad.make_dual(q, v), v, a)).tangent
    expected = np.einsum("nik,nk->ni", m.inverse_dynamics_derivatives(q.numpy(), v.numpy(), a.numpy())[0], v.numpy())
    np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-11)


def test_compiled_graphs():
    """Whole graphs, without a break, by the backend that compiles nothing, since a compiler needn't be there."""
    m = robot_named("floating")
    d = ksl.torch.differentiable(m)
    p = torch.tensor(m.parameters, requires_grad=True)
    q, v, a = given_to(m, "inverse_dynamics")

    def cost(q, v, a, p):
        wrench = d.reactions(q, v, a, p, joints=[m.joint_names[1]])
        return (d.inverse_dynamics(q, v, a, p) ** 2).sum() + (wrench**2).sum() + d.frame_poses(q)[..., :3, 3].sum()

    found = torch.autograd.grad(torch.compile(cost, fullgraph=True, backend="aot_eager")(q, v, a, p), (q, v, a, p))
    for one, other in zip(found, torch.autograd.grad(cost(q, v, a, p), (q, v, a, p))):
        torch.testing.assert_close(one, other, rtol=1e-12, atol=1e-12)


def test_operators_that_are_kept_are_limited(monkeypatch):
    """And a graph whose operator is gone says so."""
    monkeypatch.setattr("ksl.operators.calls.OPERATORS_KEPT", 2)
    m = robot_named("physics")
    d = ksl.torch.differentiable(m)
    q = torch.zeros(6, dtype=torch.float64)
    at = [d.reactions(q, 0.0, 0.0, at=(0.1 * i, 0, 0)) for i in range(5)]
    assert len(d._kept) <= 2 and not torch.equal(at[0], at[4])
    torch.testing.assert_close(d.reactions(q, 0.0, 0.0, at=(0.0, 0, 0)), at[0], rtol=0, atol=0)
    with pytest.raises(RuntimeError, match="the model of this compiled graph is of another process, or is gone; keep what ksl.torch.differentiable returns"):
        torch.ops.ksl.compute([q[None, None]], 1, 0)


def test_a_compiled_graph_for_any_number_of_states():
    m = robot_named("physics")
    d = ksl.torch.differentiable(m)
    program = torch.compile(lambda q, v: (d.bias(q, v) ** 2).sum(), fullgraph=True, dynamic=True, backend="aot_eager")
    for n in (3, 7, 4):
        q, v, _ = given_to(m, "inverse_dynamics", n=n)
        (found,) = torch.autograd.grad(program(q, v), q)
        (expected,) = torch.autograd.grad((d.bias(q, v) ** 2).sum(), q)
        torch.testing.assert_close(found, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("strict", [False, True])
def test_an_exported_graph_runs_where_its_model_is(strict):
    m = robot_named("physics")

    class Gravity(torch.nn.Module):
        calls = ksl.torch.differentiable(m)

        def forward(self, q):
            return self.calls.gravity_torque(q)

    q = torch.full((3, 6), 0.3, dtype=torch.float64)
    program = torch.export.export(Gravity(), (q,), strict=strict).module()
    torch.testing.assert_close(program(2 * q), torch.tensor(m.gravity_torque(2 * q.numpy())), rtol=0, atol=0)


def test_modules_that_have_one_are_copied_and_pickled():
    class Layer(torch.nn.Module):
        def __init__(self, calls):
            super().__init__()
            self.calls, self.gain = calls, torch.nn.Parameter(torch.ones(6, dtype=torch.float64))

        def forward(self, q):
            return self.calls.gravity_torque(q * self.gain)

    m = robot_named("physics")
    layer = Layer(ksl.torch.differentiable(m, threads=1))
    q = torch.zeros(2, 6, dtype=torch.float64) + 0.3
    expected = layer(q)
    torch.testing.assert_close(copy.deepcopy(layer)(q), expected, rtol=0, atol=0)
    torch.testing.assert_close(pickle.loads(pickle.dumps(layer.calls)).gravity_torque(q), expected, rtol=0, atol=0)


def test_precision_numbers_and_arrays():
    m = robot_named("physics")
    d = ksl.torch.differentiable(m)
    q, v, a = given_to(m, "inverse_dynamics", n=3, requires_grad=False)
    assert d.inverse_dynamics(q.float(), v.float(), a.float()).dtype == torch.float32
    torch.testing.assert_close(d.inverse_dynamics(q, 0.0, 0.0), d.gravity_torque(q), rtol=0, atol=0)
    torch.testing.assert_close(d.inverse_dynamics(q, v.numpy(), a.tolist()), d.inverse_dynamics(q, v, a), rtol=0, atol=0)
    crossed = torch.stack([q, q], dim=-1)[..., 0]  # numbers of a row are no neighbours
    assert not crossed.is_contiguous()
    torch.testing.assert_close(d.inverse_dynamics(crossed, v, a), d.inverse_dynamics(q, v, a), rtol=0, atol=0)


def test_results_stay_where_the_library_is():
    """Whichever device torch.set_default_device names: on an accelerator the extension would not take them."""
    m = robot_named("physics")
    d = ksl.torch.differentiable(m)
    q, v, a = given_to(m, "inverse_dynamics")
    found = []
    for device in ("cpu", "meta"):
        with torch.device(device):
            tau = d.inverse_dynamics(q, v.detach().numpy(), 0.5)
            found.append((tau.detach(), *torch.autograd.grad((tau**2).sum(), q), d.gravity_torque(q.tolist()).detach()))
    for here, there in zip(*found):
        torch.testing.assert_close(there, here, rtol=0, atol=0)


def test_arrays_of_numpy():
    """Of any strides, byte order and rights.  Where there is no tensor they keep their precision."""
    d = ksl.torch.differentiable(robot_named("physics"))
    q = np.linspace(-1, 1, 12).reshape(2, 6)
    expected = d.gravity_torque(torch.tensor(q))
    swapped, fixed = q.astype(q.dtype.newbyteorder()), q.copy()
    fixed.flags.writeable = False
    for given in (q, q[:, ::-1].copy()[:, ::-1], swapped, fixed, q.astype(np.longdouble)):
        torch.testing.assert_close(d.gravity_torque(given), expected, rtol=0, atol=0)
    assert d.gravity_torque(q.astype(np.float32)).dtype == d.gravity_torque(q.tolist()).dtype == torch.float32


def test_what_is_no_array_is_refused_by_name():
    m = robot_named("physics")
    d = ksl.torch.differentiable(m)
    q, tip, other = torch.zeros(6, dtype=torch.float64), m.link_names[-1], m.link_names[2]
    angle = q[0].clone().requires_grad_()
    pushed = lambda **wrenches: d.inverse_dynamics(q, 0.0, 0.0, external={{"tip": tip, "other": other}[k]: w for k, w in wrenches.items()})
    for call, said in (
        (lambda: d.gravity_torque(None), "gravity_torque: q is None; expected numbers"),
        (lambda: d.gravity_torque([angle] * 6), "gravity_torque: q is a list of tensors, whose gradients would be lost; give one tensor, by torch.stack"),
        (lambda: d.reactions(q, 0.0, 0.0, at=(angle, 0, 0)), "reactions: at is an array that is differentiated or traced"),
        (lambda: d.inverse_dynamics(q, 0.0, 0.0, external=[q]), "external is list; expected a mapping"),
        (lambda: pushed(tip=None), rf"external\['{tip}'\] is None; expected numbers"),
        (lambda: pushed(tip=3.0), rf"external\['{tip}'\] has shape \(\); expected \(…, 6\)"),
        (lambda: pushed(tip=(angle,) * 6), rf"external\['{tip}'\] is a tuple of tensors"),
        (lambda: pushed(tip=q, other=q.float()), rf"different types: external\['{tip}'\] torch.float64, external\['{other}'\] torch.float32"),
        (lambda: pushed(tip=q.expand(5, 6), other=q.expand(4, 6)), rf"leading shapes don't broadcast: external\['{tip}'\] \(5, 6\), external\['{other}'\] \(4, 6\)"),
        (lambda: pushed(tip=q.to("meta"), other=q), rf"external\['{tip}'\] is on meta, which KSL can't reach"),
        (lambda: m.gravity_torque(q.clone().requires_grad_()), r"q is differentiated or traced by torch or JAX, .*ksl.torch.differentiable\(model\)"),
        (lambda: torch.autograd.functional.jacobian(d.gravity_torque, q, vectorize=True), "gravity_torque: is_grads_batched= and vectorize= of torch.autograd .* take torch.func.jacrev"),
    ):  # fmt: skip
        with pytest.raises((ValueError, TypeError, NotImplementedError), match=said):
            call()


def test_what_is_refused():
    m = robot_named("physics")
    d = ksl.torch.differentiable(m)
    q, v, a = given_to(m, "inverse_dynamics")
    with pytest.raises(
        TypeError,
        match=r"inverse_dynamics: arguments have different types: q torch.float64, v torch.float32, a torch.float64; give all float32 or all float64, by x.to",
    ):
        d.inverse_dynamics(q, v.float(), a)
    with pytest.raises(TypeError, match=r"expected torch.float32 or torch.float64"):
        d.gravity_torque(q.half())
    with pytest.raises(ValueError, match=r"gravity_torque: q is on meta, which KSL can't reach; move it by q.cpu\(\)"):
        d.gravity_torque(torch.zeros(6, device="meta"))
    with pytest.raises(ValueError, match=r"gravity_torque: q is a tensor of torch.sparse_coo; expected a dense one, by q.to_dense\(\)"):
        d.gravity_torque(torch.zeros(2, 6).to_sparse())
    for layout in (torch.strided, torch.jagged):
        with pytest.raises(ValueError, match="gravity_torque: q is a nested tensor; expected one of one shape"):
            d.gravity_torque(torch.nested.nested_tensor([torch.zeros(2, 6), torch.zeros(1, 6)], layout=layout))
    with pytest.raises(ValueError, match=r"gravity_torque: q has shape \(2, 5\); expected \(…, 6\)"):
        d.gravity_torque(q[:, :5])
    with pytest.raises(
        TypeError, match="reactions: at is an array that is differentiated or traced, and there is no derivative by it; give three plain numbers"
    ):
        d.reactions(q, v, a, at=torch.zeros(3, requires_grad=True))
    with pytest.raises(NotImplementedError, match="reactions: there are no second derivatives of it"):
        (g,) = torch.autograd.grad((d.reactions(q, v, a) ** 2).sum(), q, create_graph=True)
        g.sum().backward()
    with pytest.raises(ksl.DescriptionError, match=f"link {m.link_names[3]}: "):
        p = torch.tensor(m.parameters)
        p[3, 0] = -1
        d.inverse_dynamics(q, v, a, p)


def test_names_that_are_not_differentiated_lead_to_those_that_are():
    d = ksl.torch.differentiable(robot_named("ur5"))
    for name, said in (
        ("invers_dynamics", "a TorchCalls has no 'invers_dynamics'; did you mean 'inverse_dynamics'"),
        ("fkine", "that is d.frame_poses(q, names)"),
        ("frame_pose", "did you mean 'frame_poses'? the model has it, without derivatives: m.frame_pose"),
        ("body_jacobian", "the model has it, without derivatives: m.jacobian(q, name)"),
        ("simulate", "the model has it, without derivatives: m.simulate"),
        ("zzz", "dir(d) lists all"),
    ):
        with pytest.raises(AttributeError, match=re.escape(said)):
            getattr(d, name)
    assert not hasattr(d, "__array__") and copy.deepcopy(d).model is not None


def test_without_torch_the_command_that_brings_it_is_named():
    code = "import sys\nsys.modules['torch'] = None\ntry:\n    import ksl.torch\nexcept ModuleNotFoundError as e:\n    print(e)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "ksl.torch needs torch; install it with: pip install 'ksl[torch]'\n", done.stderr
