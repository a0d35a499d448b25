"""ksl.torch on cards: values, gradients and maps by what m.compile makes for one, on a driver in a card's place, for which the processor's tensors are a card's."""

import functools
import sys
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs torch: pip install 'ksl[torch]'")
from torch.autograd import gradcheck

sys.path[:0] = [str(Path(__file__).parents[1] / "generation" / part) for part in ("card", "")]
from fake_card import FakeCard
from operator_cases import robot_named

import ksl.torch
from ksl.generation.card import arrays, calls
from ksl.operators import torch_arrays, torch_card


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fake_card")


@pytest.fixture
def card(folder, monkeypatch):
    monkeypatch.setenv("KSL_CACHE", str(folder / "cache"))
    for module in (torch_arrays, torch_card):
        monkeypatch.setattr(module, "card_of", lambda x: 0)
    monkeypatch.setattr(torch_card, "stream_of", lambda card: 7)
    return FakeCard(folder, monkeypatch.setattr)


CASES = {
    "inverse_dynamics": ("q", "v", "a"), "forward_dynamics": ("q", "v", "tau"), "gravity_torque": ("q",), "reactions": ("q", "v", "a"), "potential_energy": ("q",),
    "mass_matrix": ("q",), "frame_velocities": ("q", "v"), "center_of_mass": ("q",),
}  # fmt: skip
NAMES = {"reactions": ":{joint}", "frame_velocities": ":{link}"}
ROW = {"potential_energy": "energy"}


def compiled(m, rows, kinds=("", "vjp.", "jvp.")):
    names = {"joint": m.joints[1].name, "link": m.link_names[-1]}
    return m.compile([f"{kind}{ROW.get(row, row)}{NAMES.get(row, '').format(**names)}" for row in rows for kind in kinds], device="cuda")


def call_of(m, row):
    call = getattr(ksl.torch.differentiable(m), row)
    return {"reactions": lambda *x: call(*x, joints=[m.joints[1].name]), "frame_velocities": lambda *x: call(*x, [m.link_names[-1]])}.get(row, call)


def given_to(m, row, n=3, requires_grad=True):
    rng = np.random.default_rng(1)
    q = np.stack([m.random(k) for k in range(n)]) * (rng.uniform(0.7, 1.4, (n, 1)) if m.nq != m.nv else 1)
    return [torch.tensor(q if name == "q" else rng.normal(size=(n, m.nv)), requires_grad=requires_grad) for name in CASES[row]]


@pytest.mark.parametrize("robot", ["floating", "every kind", "physics"])
def test_values_and_gradients_are_those_of_the_processor(card, robot, monkeypatch):
    m = robot_named(robot)
    rows = list(CASES) if robot == "floating" else ["inverse_dynamics", "frame_velocities"]
    on_card = compiled(m, rows)
    for row in rows:
        x, there = given_to(m, row), given_to(m, row)
        before = card["launches"]
        y, weights = call_of(on_card, row)(*there), torch.randn(call_of(on_card, row)(*there).shape, dtype=torch.float64)
        (y * weights).sum().backward()
        assert card["launches"] == before + 3 and card["stream"] == 7
        with monkeypatch.context() as patch:
            for module in (torch_arrays, torch_card):
                patch.setattr(module, "card_of", lambda x: None)
            expected = call_of(m, row)(*x)
            (expected * weights).sum().backward()
            along = torch.func.jvp(call_of(m, row), tuple(each.detach() for each in x), tuple(torch.ones_like(each) for each in x))[1]
        torch.testing.assert_close(y, expected, rtol=1e-12, atol=1e-12)
        for a, b in zip(there, x):
            torch.testing.assert_close(a.grad, b.grad, rtol=1e-9, atol=1e-9)
        found = torch.func.jvp(call_of(on_card, row), tuple(each.detach() for each in there), tuple(torch.ones_like(each) for each in there))[1]
        torch.testing.assert_close(found, along, rtol=1e-9, atol=1e-9)


def test_transforms_and_graphs(card):
    m = robot_named("floating")
    f = call_of(compiled(m, ["inverse_dynamics"]), "inverse_dynamics")
    q, v, a = given_to(m, "inverse_dynamics", requires_grad=False)
    expected = f(q, v, a)
    torch.testing.assert_close(torch.func.vmap(f)(q, v, a), expected, rtol=0, atol=0)
    torch.testing.assert_close(torch.func.vmap(f, in_dims=(0, None, 1))(q, v[0], a.T), f(q, v[0], a), rtol=0, atol=0)
    by = torch.func.jacrev(f, argnums=2)(q[0], v[0], a[0])
    torch.testing.assert_close(by, torch.tensor(m.mass_matrix(unit(q[0]))), rtol=1e-9, atol=1e-9)
    assert gradcheck(f, [x[:2].clone().requires_grad_() for x in (q, v, a)], atol=1e-4, rtol=1e-4)
    graph = torch.compile(lambda q, v, a: f(q, v, a) * 2, backend="aot_eager", fullgraph=True)
    x = [each.clone().requires_grad_() for each in (q, v, a)]
    torch.testing.assert_close(graph(*x), 2 * expected, rtol=0, atol=0)
    graph(*x).sum().backward()
    y = [each.clone().requires_grad_() for each in (q, v, a)]
    (2 * f(*y)).sum().backward()
    for one, other in zip(x, y):
        torch.testing.assert_close(one.grad, other.grad, rtol=0, atol=0)
    torch.testing.assert_close(f(q, 0.0, a), f(q, torch.zeros_like(v), a), rtol=0, atol=0)


@pytest.mark.parametrize(
    ("row", "which"),
    [
        ("inverse_dynamics", "two links"),
        ("forward_dynamics", "two links"),
        ("reactions", "two links"),
        ("potential_energy", "all links"),
        ("reactions", "all links"),
    ],
)
def test_parameters_of_links_and_gradients_by_them(card, row, which, monkeypatch):
    """One set for all states, one for each, and one for the states of a group."""
    m = robot_named("floating")
    links = m.link_names if which == "all links" else (m.link_names[-1], m.link_names[1])
    kinds = [f"{kind}{ROW.get(row, row)}{NAMES.get(row, '').format(joint=m.joints[1].name)}" for kind in ("", "vjp.", "jvp.")]
    f, exact = (call_of(x, row) for x in (m.compile(kinds, device="cuda", parameters=links), m))
    own = torch.tensor(np.stack([m.link(link).parameters for link in links]))
    shapes = [((3,), ()), ((3,), (3, 1)), ((2, 3), (2, 1, 1))]  # of states, and of parameters
    for states, of_sets in shapes:
        x = [torch.tensor(np.broadcast_to(each.detach().numpy()[: states[-1]], (*states, each.shape[-1])).copy()) for each in given_to(m, row)]
        sets = own * (1 + 0.2 * torch.rand((*of_sets[:-1], *own.shape), dtype=torch.float64))
        as_given = lambda p: p if which == "all links" else {link: p[..., k, :] for k, link in enumerate(links)}
        of = lambda f: lambda *x: f(*x[:-1], as_given(x[-1]))
        results = []
        for call, there in ((f, 0), (exact, None)):
            with monkeypatch.context() as patch:
                for module in (torch_arrays, torch_card):
                    patch.setattr(module, "card_of", lambda x, there=there: there)
                given = [each.clone().requires_grad_() for each in (*x, sets)]
                y = of(call)(*given)
                (y * torch.linspace(-1, 1, y.numel(), dtype=torch.float64).reshape(y.shape)).sum().backward()
                along = torch.func.jvp(of(call), tuple(each.detach() for each in given), tuple(torch.cos(each.detach()) for each in given))[1]
                results.append([y, along, *(each.grad for each in given)])
        for one, other in zip(*results, strict=True):
            torch.testing.assert_close(one, other, rtol=1e-9, atol=1e-9)
        assert results[0][-1].shape == sets.shape and (results[0][-1] != 0).any()
    assert gradcheck(of(f), [each[:1, :2].clone().requires_grad_() for each in x] + [sets[:1, :1].clone().requires_grad_()], atol=1e-4, rtol=1e-4)
    if row == "inverse_dynamics":
        graph = torch.compile(lambda *x: of(f)(*x), backend="aot_eager", fullgraph=True)
        torch.testing.assert_close(graph(*x, sets), of(f)(*x, sets), rtol=0, atol=0)
    mapped = torch.func.vmap(of(f), in_dims=(*(0 for _ in x), None))(*x, sets[0, 0])
    torch.testing.assert_close(mapped, of(f)(*x, sets[0, 0]), rtol=0, atol=0)


def unit(q):
    whole = q.numpy().copy()
    whole[3:7] /= np.linalg.norm(whole[3:7])
    return whole


def test_the_blocks_of_the_page_run(card, monkeypatch):
    """One after the other, in a thousandth of the states; tensors of the processor are the card's."""
    page = (Path(__file__).parents[2] / "docs" / "card.md").read_text(encoding="utf-8")
    monkeypatch.chdir(Path(__file__).parents[2])
    monkeypatch.setattr(arrays, "card_of_tensor", lambda x: 0)
    for module in (arrays, calls):
        monkeypatch.setattr(module, "stream_of_torch", lambda card: 9)
    here = torch.randn
    monkeypatch.setattr(torch, "randn", lambda *shape, device: here(*shape))
    scope: dict = {}
    own = page.split("<!-- tested: test/operators/torch_card_test.py -->\n```python\n")[1:]
    *first, runs = (block.split("```")[0].replace("1_000_000", "1_000") for block in own)
    for block in first:
        exec(block, scope)
    m, q, v, a, tau = (scope[name] for name in ("m", "q", "v", "a", "tau"))
    assert tau.shape == (1000, 7) and card["stream"] == 7
    np.testing.assert_array_equal(tau, m.inverse_dynamics(*(x.detach().numpy() for x in (q, v, a))))
    assert q.grad.shape == (1000, 7) and (q.grad != 0).any()
    with torch.no_grad():
        again = scope["fast"].inverse_dynamics(q, v, a)
    torch.testing.assert_close(again, tau, rtol=0, atol=0)
    assert card["stream"] == 9
    exec(runs, scope)
    assert scope["run"].q.shape == (1000, 2, 7)
    at, moving = (x[7].detach().double().numpy() for x in (q, v))
    for _ in range(3):
        one = m.simulate(at, moving, [0, 0.01], -2 * moving, method="semi_implicit_euler", step=1e-3)
        at, moving = one.q[-1], one.v[-1]
    np.testing.assert_allclose(scope["v"][7], moving, rtol=1e-3, atol=1e-3)


def test_what_is_missing_is_said(card):
    m = robot_named("floating")
    q, v, a = given_to(m, "inverse_dynamics")
    for call, kind, sentence in (
        (
            lambda: ksl.torch.differentiable(m).inverse_dynamics(q, v, a),
            ValueError,
            r"code for it is missing: m.compile\(\[…, 'inverse_dynamics'\], device='cuda'\) makes it; or move the tensors by .cpu",
        ),
        (
            lambda: call_of(compiled(m, ["inverse_dynamics"], [""]), "inverse_dynamics")(q, v, a).sum().backward(),
            ValueError,
            r"'vjp.inverse_dynamics'\], device='cuda'",
        ),
        (lambda: call_of(compiled(m, ["inverse_dynamics"], [""]), "inverse_dynamics")(q.float(), v.float(), a.float()), ValueError, "scalar='float'"),
        (
            lambda: ksl.torch.differentiable(m).inverse_dynamics(q, v, a, torch.tensor(m.parameters)),
            ValueError,
            r"m.compile\(\[…, 'inverse_dynamics'\], device='cuda', parameters=m.link_names\) makes it",
        ),
        (
            lambda: call_of(compiled(m, ["inverse_dynamics"]), "inverse_dynamics")(q, v, a, {m.link_names[-1]: q[0, :1].expand(10)}),
            ValueError,
            rf"device='cuda', parameters=\['{m.link_names[-1]}'\]\) makes it",
        ),
        (lambda: call_of(m, "frame_velocities")(q, v), ValueError, "with the links or joints that the call names behind a colon"),
    ):
        with pytest.raises(kind, match=sentence):
            call()
    f = call_of(compiled(m, ["gravity_torque"]), "gravity_torque")
    (by,) = torch.autograd.grad(f(q).sum(), q, create_graph=True)
    with pytest.raises(NotImplementedError, match="cards have first derivatives alone"):
        by.sum().backward()


def test_tensors_of_two_devices_are_refused():
    m = robot_named("physics")
    from torch._subclasses import FakeTensorMode

    with FakeTensorMode():
        here, there = torch.zeros(2, 6, dtype=torch.float64), torch.zeros(2, 6, dtype=torch.float64, device="cuda")
    d = ksl.torch.differentiable(m)
    with pytest.raises(ValueError, match="inverse_dynamics: v is on cpu, and an argument before it on cuda:0; move all to one device"):
        d.inverse_dynamics(there, here, here)
    with pytest.raises(ValueError, match="v is in the processor's memory, and others are on cuda:0"):
        d.inverse_dynamics(there, np.zeros((2, 6)), 0.0)
    with pytest.raises(ValueError, match="tensors are on a card, and code for it is missing"):
        d.inverse_dynamics(there, there, there)


def test_the_tutorial_runs_on_a_card(card, capsys):
    """With few environments and steps of training: it prints what it prints on a processor, and its rollouts are one call each."""
    page = (Path(__file__).parents[2] / "docs/tutorials/reactions_in_a_reward.md").read_text(encoding="utf-8")
    blocks = [block.split("```")[0].replace("range(30)", "range(2)") for block in page.split("```python\n")[1:]]
    printed = []
    for there in (True, False):
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(Path(__file__).parents[2])
            if not there:
                for module in (torch_arrays, torch_card):
                    patch.setattr(module, "card_of", lambda x: None)
            before = card["launches"]
            scope: dict = {}
            for block in blocks:
                words = {"torch.cuda.is_available()": str(there), '("cuda", 65_536)': '("cpu", 8)', '("cpu", 64)': '("cpu", 8)'}
                exec(functools.reduce(lambda text, word: text.replace(word, words[word]), words, block), scope)
            assert card["launches"] == before + (4 * 2 + 4 if there else 0)
        printed.append(capsys.readouterr().out)
    assert printed[0] == printed[1] and "L10h" in printed[0]
