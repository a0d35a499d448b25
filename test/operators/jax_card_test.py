"""ksl.jax on cards: programs whose custom calls start kernels, on a driver in a card's place, for which programs for the processor are a card's."""

import ctypes
import os
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

os.environ.setdefault("JAX_PLATFORMS", "cpu")
jax = pytest.importorskip("jax", reason="needs JAX: pip install 'ksl[jax]'")
import jax.numpy as jnp
from jax.interpreters import mlir

sys.path[:0] = [str(Path(__file__).parents[1] / "generation" / part) for part in ("card", "")]
from fake_card import FakeCard

import ksl.jax
from ksl import _core
from ksl.model.model import code_on_card
from ksl.operators import jax_arrays, jax_card

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fake_card")


@pytest.fixture(scope="module")
def streams(folder):
    """The function of cards as one of the processor."""
    library = folder / "streams.so"
    subprocess.run(["g++", "-std=c++20", "-shared", "-fPIC", f"-I{ROOT / 'python'}", Path(__file__).with_name("xla_streams.cpp"), "-o", library], check=True)
    streams = ctypes.CDLL(str(library))
    inside = ctypes.pythonapi.PyCapsule_GetPointer
    inside.restype, inside.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    ctypes.c_void_p.in_dll(streams, "of_cards").value = inside(_core.xla_handler_on_card, None)
    jax.ffi.register_ffi_target(jax_card.TARGET, jax.ffi.pycapsule(streams.of_processor), platform="cpu")
    return streams


@pytest.fixture
def card(folder, streams, monkeypatch):
    monkeypatch.setenv("KSL_CACHE", str(folder / "cache"))
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    for stage, primitive in jax_arrays.PRIMITIVES.items():
        mlir.register_lowering(primitive, partial(jax_arrays._lower_on_card, stage), platform="cpu")
    card = FakeCard(folder, monkeypatch.setattr)
    yield card
    card.fail("", 0)
    card.say(of_streams=0)
    for stage, primitive in jax_arrays.PRIMITIVES.items():
        mlir.register_lowering(primitive, partial(jax_arrays._lower, stage), platform="cpu")
    jax.config.update("jax_enable_x64", before)


def robot():
    """Joints whose velocity isn't the rate of their numbers."""
    b = ksl.Builder("small").add_link("base")
    for name, kind, on in (("a", "floating", "base"), ("b", "planar", "a")):
        b.add_link(name, 1.5, (0.1, 0.2, -0.1), np.diag([0.2, 0.3, 0.25])).add_joint(f"to_{name}", kind, on, name, xyz=(0.3, 0, 0.1))
    return b.build()


def given_to(m, n=3):
    rng = np.random.default_rng(1)
    q = np.stack([m.random(k) for k in range(n)]) * rng.uniform(0.7, 1.4, (n, 1))  # quaternions of any length
    return [jnp.asarray(q), *(jnp.asarray(rng.normal(size=(n, m.nv))) for _ in range(2))]


def test_values_derivatives_and_transforms_are_those_of_the_processor(card, streams):
    m, fast = robot(), robot().compile(["inverse_dynamics", "jvp.inverse_dynamics", "vjp.inverse_dynamics"], device="cuda")
    f, on_card, given = ksl.jax.differentiable(m).inverse_dynamics, ksl.jax.differentiable(fast).inverse_dynamics, given_to(m)
    weights = jnp.linspace(-1, 1, 3 * m.nv).reshape(3, m.nv)
    cost = lambda f, *x: (f(*x) * weights).sum()
    on = [jax.jit(on_card)(*given), jax.vmap(on_card, in_axes=(0, None, 0))(given[0], given[1][0], given[2])]
    on += [*jax.jit(jax.grad(partial(cost, on_card), argnums=(0, 1, 2)))(*given), *jax.jvp(on_card, given, [jnp.cos(x) for x in given])]
    on.append(jax.lax.scan(lambda v, _: (v - 0.01 * on_card(given[0], v, given[2]), None), given[1], None, length=3)[0])
    jax.block_until_ready(on)  # calls return before they are done
    assert card["stream"] == 7 and card["launches"] == 8 and ctypes.c_uint32.in_dll(streams, "traits").value == 1  # which XLA may record
    for stage, primitive in jax_arrays.PRIMITIVES.items():
        mlir.register_lowering(primitive, partial(jax_arrays._lower, stage), platform="cpu")
    expected = [jax.jit(f)(*given), jax.vmap(f, in_axes=(0, None, 0))(given[0], given[1][0], given[2])]
    expected += [*jax.jit(jax.grad(partial(cost, f), argnums=(0, 1, 2)))(*given), *jax.jvp(f, given, [jnp.cos(x) for x in given])]
    expected.append(jax.lax.scan(lambda v, _: (v - 0.01 * f(given[0], v, given[2]), None), given[1], None, length=3)[0])
    for x, y in zip(on, expected, strict=True):
        np.testing.assert_allclose(x, y, rtol=1e-9, atol=1e-9)


def test_parameters_of_links_and_gradients_by_them(card):
    """One set for all states, one for each, and one for the states of a group; in a map of sets, too."""
    m = robot()
    words = [f"{kind}inverse_dynamics" for kind in ("", "jvp.", "vjp.")]
    fast = m.compile(words, device="cuda", parameters=["b"]).compile(words, device="cuda", parameters=m.link_names)
    q, v, a = given_to(m)
    some, rng = np.array(m.link("b").parameters), np.random.default_rng(2)
    wide = [jnp.broadcast_to(x, (2, *x.shape)) for x in (q, v, a)]
    cases = [((q, v, a), {"b": jnp.asarray(some * rng.uniform(1, 2, (3, 1)))}), (wide, {"b": jnp.asarray(some * rng.uniform(1, 2, (2, 1, 1)))})]
    cases.append(((q, v, a), jnp.asarray(m.parameters * rng.uniform(1, 2))))

    def all_of(m):
        f = ksl.jax.differentiable(m).inverse_dynamics

        def found():
            for x, p in cases:
                yield f(*x, p)
                yield from jax.tree.leaves(jax.grad(lambda x, p: jnp.sin(f(*x, p)).sum(), argnums=(0, 1))(x, p))
                yield jax.jvp(lambda p, x=x: f(*x, p), (p,), (jax.tree.map(jnp.cos, p),))[1]
            yield jax.vmap(lambda ten: f(q, v, a, {"b": ten}))(cases[0][1]["b"])

        return jax.jit(lambda: list(found()))()

    on = jax.block_until_ready(all_of(fast))
    before = card["launches"]
    for stage, primitive in jax_arrays.PRIMITIVES.items():
        mlir.register_lowering(primitive, partial(jax_arrays._lower, stage), platform="cpu")
    for x, y in zip(on, all_of(m), strict=True):
        np.testing.assert_allclose(x, y, rtol=1e-9, atol=1e-9)
    assert before > 0 and card["launches"] == before  # those of the processor


def test_what_cannot_be_started_is_said(card):
    fast = robot().compile(["gravity_torque"], device="cuda")
    call, q = ksl.jax.differentiable(fast).gravity_torque, given_to(fast)[0]
    before = card["launches"]
    assert call(q[:0]).shape == (0, fast.nv) and card["launches"] == before
    jax.block_until_ready(call(q))
    for function, code, said in (
        ("cuLaunchKernel", 701, r"ksl: the card's driver reports CUDA_ERROR_OF_THE_FAKE \(701\)"),
        ("cuStreamGetCtx", 999, r"reports an unknown error \(999\)"),
    ):
        card.fail(function, code)
        with pytest.raises(Exception, match=said):
            jax.block_until_ready(call(q))
    card.fail("", 0)
    card.say(of_streams=5)
    with pytest.raises(Exception, match="the program's stream is of no card that the kernel is loaded on"):
        jax.block_until_ready(call(q))
    card.say(of_streams=1)  # the second card
    call(q).block_until_ready()
    assert card["card"] == 1
    (function,) = code_on_card(fast).functions
    again = jax.ffi.ffi_call(jax_card.TARGET, jax.ShapeDtypeStruct((1, 3, fast.nv), jnp.float64))
    number = function.for_programs.number
    for x, kernel, said in (
        (q[None], number - 1, "ksl: the model of this compiled function is of another process, or is gone; compile the function here"),
        (q[None, :, 1:], number, "ksl: arguments don't fit the kernel"),
        (q[None, :2], number, "ksl: arguments don't fit the kernel"),
        (q[None].astype(jnp.float32), number, "ksl: arrays of another precision than the kernel's"),
    ):
        with pytest.raises(Exception, match=said):
            jax.block_until_ready(again(x, kernel=np.int64(kernel)))
    at = fast.neutral()
    np.testing.assert_array_equal(again(jnp.asarray(at)[None, None], kernel=np.int64(number))[0], [fast.gravity_torque(at)] * 3)  # one row for all


FOUR = "--xla_force_host_platform_device_count=4"


def test_shard_map_over_devices():
    """In a process of four devices."""
    here = f"{Path(__file__).name}::test_four_devices_share_the_states"
    run = subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", here],
        cwd=Path(__file__).parent, env=os.environ | {"XLA_FLAGS": FOUR}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert run.returncode == 0 and "1 passed" in run.stdout, run.stdout


@pytest.mark.skipif(os.environ.get("XLA_FLAGS") != FOUR, reason="test_shard_map_over_devices runs it, in a process of its own")
def test_four_devices_share_the_states(card, monkeypatch):
    """Each computes a part by a kernel, also of gradients, and those by what all devices share are added; as on one device, for a card and for processors."""
    page = (ROOT / "docs" / "card.md").read_text(encoding="utf-8")
    (block,) = [block.split("```")[0] for block in page.split("```python\n")[1:] if "shard_map" in block.split("```")[0]]
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(jax, "devices", lambda platform=None: jax.local_devices(backend="cpu"))
    card.say(cards=4)
    scope: dict = {}
    exec(block.replace("1_000_000", "1_000").replace("np.float32", "np.float64").replace('"float"', '"double"'), scope)
    m, fast, mesh, states, shared = (scope[name] for name in ("m", "fast", "mesh", "states", "shared"))
    jax.block_until_ready([scope["tau"], scope["by_a"]])
    assert card["launches"] == 4 * 3 and card["modules"] == 4  # a value, and a value with its gradient
    q, v, a = (np.asarray(x) for x in states)
    np.testing.assert_array_equal(scope["tau"], m.inverse_dynamics(q, v, a))
    assert [x.data.shape for x in scope["tau"].addressable_shards] == [(250, m.nv)] * 4
    np.testing.assert_allclose(scope["by_a"], np.einsum("nij,nj->ni", m.mass_matrix(q), 2 * np.asarray(scope["tau"])), rtol=1e-9, atol=1e-9)
    p, link = jnp.asarray(m.link("panda_link7").parameters), jax.sharding.PartitionSpec
    d = ksl.jax.differentiable(m)
    of_one = lambda a, p: d.inverse_dynamics(*states[:2], a, {"panda_link7": p})
    for on_card in (True, False):
        if not on_card:
            for stage, primitive in jax_arrays.PRIMITIVES.items():
                mlir.register_lowering(primitive, partial(jax_arrays._lower, stage), platform="cpu")
        words = [f"{kind}inverse_dynamics" for kind in ("", "jvp.", "vjp.")]
        of = ksl.jax.differentiable(m.compile(words, device="cuda", parameters=["panda_link7"]) if on_card else m)
        f = jax.shard_map(
            lambda q, v, a, p, of=of: of.inverse_dynamics(q, v, a, {"panda_link7": p}),
            mesh=mesh,
            in_specs=(*(link("cards"),) * 3, link()),
            out_specs=link("cards"),
        )
        cost = lambda a, p: jnp.sin(f(*states[:2], a, p)).sum()
        found = [
            *jax.jit(jax.grad(cost, argnums=(0, 1)))(states[2], p),
            jax.jit(lambda a, p: jax.jvp(f, (*states[:2], a, p), (*states[:2], a, p))[1])(states[2], p),
        ]
        if on_card:
            sharded = found
    exact = [*jax.grad(lambda a, p: jnp.sin(of_one(a, p)).sum(), argnums=(0, 1))(states[2], p)]
    for x, y, z in zip(sharded, found, [*exact, found[2]], strict=True):
        np.testing.assert_allclose(x, y, rtol=1e-9, atol=1e-8)
        np.testing.assert_allclose(y, z, rtol=1e-9, atol=1e-8)


def test_programs_for_cards_have_the_call_or_say_what_is_missing(card):
    fast = robot().compile(["gravity_torque"], scalar="float", device="cuda")
    q = given_to(fast)[0]
    text = jax.jit(ksl.jax.differentiable(fast).gravity_torque).trace(q.astype(jnp.float32)).lower(lowering_platforms=("cuda",)).as_text()
    assert "custom_call @ksl_card" in text and f"kernel = {code_on_card(fast).functions[0].for_programs.number} : i64" in text
    for call, kind, said in (
        (
            lambda: ksl.jax.differentiable(fast).gravity_torque(q),
            ValueError,
            r"gravity_torque: arrays are on a card, and code for it is missing: m.compile\(\[…, 'gravity_torque'\], device='cuda'\) makes it; or move the arrays by jax.device_put",
        ),
        (
            lambda: jax.grad(lambda q: ksl.jax.differentiable(fast).gravity_torque(q).sum())(q.astype(jnp.float32)),
            ValueError,
            "'vjp.gravity_torque'.*scalar='float'",
        ),
        (lambda: ksl.jax.differentiable(fast).gravity_torque(q, fast.parameters), ValueError, "parameters=m.link_names"),
    ):
        with pytest.raises(kind, match=said):
            call()
