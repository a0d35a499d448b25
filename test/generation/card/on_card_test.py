"""Calls on a card that is there: numbers, streams, graphs, memory, torch, and JAX.  `make card` runs it; without a card it is skipped, and calls_test.py runs a driver in its place."""

import sys
from pathlib import Path

import numpy as np
import pytest
from generated_code import EXAMPLES

import ksl
from ksl.base.errors import CompilerError
from ksl.generation.card.driver import system_driver

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "bench"))
from card_memory import Array, Card

try:
    DRIVER = system_driver()
except CompilerError as error:
    pytest.skip(f"no card: {error}", allow_module_level=True)

ROWS = ["inverse_dynamics", "forward_dynamics", "reactions", "mass_matrix", "inverse_dynamics_derivatives", "energy"]
BOUND = {"double": 1e-11, "float": 2e-3}


@pytest.fixture(scope="module")
def real():
    return Card(DRIVER)


def states(m, n):
    rng = np.random.default_rng(n)
    return np.stack([m.random(k) for k in range(n)]), *rng.normal(size=(2, n, m.nv))


@pytest.mark.parametrize("scalar", ["double", "float"])
@pytest.mark.parametrize("robot", ["ur5", "panda", "floating ur5"])
def test_results_agree_with_the_engine(real, robot, scalar):
    m = ksl.load(EXAMPLES / f"{robot.split()[-1]}.urdf", floating_base="floating" in robot)
    dtype = np.float64 if scalar == "double" else np.float32
    fast = m.compile(ROWS, scalar=scalar, device="cuda")
    for n in (1, 33, 100_000):
        given = [x.astype(dtype) for x in states(m, min(n, 1000))]
        given = [np.tile(x, (-(-n // len(x)), 1))[:n] for x in given]
        for row in ROWS if n < 1000 else ROWS[:3]:
            taken = given[: {"mass_matrix": 1, "energy": 2}.get(row, 3)]
            expected = getattr(m, row)(*(x[:1000].astype(float) for x in taken))
            several = expected if isinstance(expected, tuple) else (expected,)
            out = tuple(Array(real, (n, *y.shape[1:]), dtype) for y in several)
            getattr(fast, row)(*map(real.array, taken), out=out if len(out) > 1 else out[0])
            for x, y in zip(out, several, strict=True):
                assert np.abs(x.numpy()[: len(y)] - y).max() <= BOUND[scalar] * np.abs(y).max(), (row, n)


@pytest.mark.parametrize("method", ["semi_implicit_euler", "rk4"])
def test_each_state_has_its_own_link(real, method):
    """Efforts, and runs, of robots that differ."""
    m = ksl.load(EXAMPLES / "ur5.urdf")
    fast = m.compile(["inverse_dynamics", f"simulate:{method}"], device="cuda", parameters=["wrist_3_link"])
    q, v, a = states(m, 40)
    own = m.link("wrist_3_link").parameters * np.linspace(0.5, 2, 40)[:, None]
    there, given = {"wrist_3_link": real.array(own)}, [real.array(x) for x in (q, v, a)]
    efforts = real.array(np.zeros((40, 6)))
    fast.inverse_dynamics(*given, parameters=there, out=efforts)
    for k in (0, 17, 39):
        alone = m.with_parameters({"wrist_3_link": own[k]})
        np.testing.assert_allclose(efforts.numpy()[k], alone.inverse_dynamics(q[k], v[k], a[k]), rtol=0, atol=1e-10)
    torch = pytest.importorskip("torch")  # whose memory results of runs take
    if not torch.cuda.is_available():
        pytest.skip("torch has no CUDA")
    of_torch = [torch.tensor(x, device="cuda") for x in (q, v, own)]
    run = fast.simulate(*of_torch[:2], [0, 0.05], method=method, step=1e-3, parameters={"wrist_3_link": of_torch[2]})
    alone = m.with_parameters({"wrist_3_link": own[17]}).simulate(q[17], v[17], [0, 0.05], method=method, step=1e-3)
    np.testing.assert_allclose(run.q[17, -1].cpu().numpy(), alone.q[-1], rtol=0, atol=1e-9)


def test_a_graph_has_the_call(real):
    m = ksl.load(EXAMPLES / "ur5.urdf")
    fast, (q, v, a) = m.compile(["inverse_dynamics"], device="cuda"), states(m, 500)
    given, out = [real.array(x) for x in (q, v, a)], real.array(np.zeros((500, 6)))
    launch = real.graph(lambda: fast.inverse_dynamics(*given, out=out))
    assert not out.numpy().any()  # captured, and not run
    launch()
    np.testing.assert_allclose(out.numpy(), m.inverse_dynamics(q, v, a), rtol=0, atol=1e-10)


def test_ten_thousand_calls_take_no_memory(real):
    m = ksl.load(EXAMPLES / "ur5.urdf")
    fast, given = m.compile(["inverse_dynamics"], device="cuda"), [real.array(x) for x in states(m, 64)]
    out = real.array(np.zeros((64, 6)))
    fast.inverse_dynamics(*given, out=out)
    real.wait()
    before = real.free_bytes()
    for _ in range(10_000):
        fast.inverse_dynamics(*given, out=out)
    real.wait()
    assert real.free_bytes() >= before


def test_tensors_of_torch_and_their_gradients():
    torch = pytest.importorskip("torch")
    if not torch.cuda.is_available():
        pytest.skip("torch has no CUDA")
    import ksl.torch

    m = ksl.load(EXAMPLES / "ur5.urdf", floating_base=True)
    fast = m.compile(["inverse_dynamics", "vjp.inverse_dynamics", "jvp.inverse_dynamics"], device="cuda")
    given = [torch.tensor(x, device="cuda") for x in states(m, 50)]
    side = torch.cuda.Stream()
    with torch.cuda.stream(side):
        tau = fast.inverse_dynamics(*given)
    side.synchronize()
    expected = m.inverse_dynamics(*states(m, 50))
    assert tau.is_cuda and np.abs(tau.cpu().numpy() - expected).max() <= 1e-11 * np.abs(expected).max()
    d = ksl.torch.differentiable(fast)
    assert torch.autograd.gradcheck(d.inverse_dynamics, [x[:2].clone().requires_grad_() for x in given], check_forward_ad=True, atol=1e-4, rtol=1e-4)
    graph = torch.cuda.CUDAGraph()
    with torch.cuda.graph(graph):
        captured = d.inverse_dynamics(*given)
    graph.replay()
    torch.cuda.synchronize()
    torch.testing.assert_close(captured, tau, rtol=1e-12, atol=1e-12)
    compiled = torch.compile(lambda *x: d.inverse_dynamics(*x) * 2, backend="aot_eager", fullgraph=True)
    torch.testing.assert_close(compiled(*given), 2 * tau, rtol=1e-12, atol=1e-12)
    torch.testing.assert_close(torch.func.vmap(d.inverse_dynamics)(*given), tau, rtol=1e-12, atol=1e-12)


def test_arrays_of_jax_and_their_gradients():
    jax = pytest.importorskip("jax")
    try:
        device = jax.devices("cuda")[0]
    except RuntimeError:
        pytest.skip("JAX has no CUDA")
    import ksl.jax

    m = ksl.load(EXAMPLES / "ur5.urdf", floating_base=True)
    fast = m.compile(["inverse_dynamics", "vjp.inverse_dynamics", "jvp.inverse_dynamics"], scalar="float", device="cuda")
    given = [jax.device_put(x.astype(np.float32), device) for x in states(m, 50)]
    d, expected = ksl.jax.differentiable(fast), m.inverse_dynamics(*states(m, 50))
    for found in (d.inverse_dynamics(*given), jax.jit(d.inverse_dynamics)(*given), jax.vmap(d.inverse_dynamics)(*given)):
        assert found.devices() == {device} and np.abs(np.asarray(found) - expected).max() <= BOUND["float"] * np.abs(expected).max()
    by_a = jax.jit(jax.grad(lambda a: d.inverse_dynamics(given[0], 0.0, a).sum()))(given[2])
    exact = m.mass_matrix(states(m, 50)[0]).sum(axis=1)
    assert np.abs(np.asarray(by_a) - exact).max() <= BOUND["float"] * np.abs(exact).max()
