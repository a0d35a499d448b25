"""`m.compile(…, device="cuda")` on a driver in place of a card's: the engine's numbers, streams, memory, the cache, and a sentence for all that can't be."""

import gc
import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from fake_card import FakeArray
from generated_code import EXAMPLES, FOLLOWED

import ksl
from ksl.base.errors import ArgumentError, CompilerError
from ksl.generation.card import driver as drivers
from ksl.generation.card.driver import Driver

ROWS = ["inverse_dynamics", "energy", "reactions:elbow+base", "jacobian:tool0", "point_velocity:tool0", "mass_matrix"]


def states(m, n, dtype=np.float64):
    rng = np.random.default_rng(n)
    return [x.astype(dtype) for x in (np.stack([m.random(k) for k in range(n)]), rng.normal(size=(n, m.nv)), rng.normal(size=(n, m.nv)))]


def test_calls_have_the_numbers_of_the_engine(card, ur5):
    fast = ur5.compile(ROWS, device="cuda").compile(["inverse_dynamics"], scalar="float", device="cuda:1").compile(["energy"])
    assert fast.compiled == ("energy", *ROWS, "inverse_dynamics")
    for n in (1, 32, 33, 300):
        q, v, a = states(ur5, n)
        on = [card.array(x, stream=5) for x in (q, v, a)]
        for row, given, keywords in (
            ("inverse_dynamics", 3, {}), ("energy", 2, {}), ("reactions", 3, {"joints": ["elbow", "base"]}), ("reactions", 3, {"joints": ("elbow", "base"), "on": "child", "threads": 2}),
            ("jacobian", 1, {"name": "tool0"}), ("point_velocity", 2, {"name": "tool0", "point": np.zeros(3)}), ("mass_matrix", 1, {}),
        ):  # fmt: skip
            expected = getattr(ur5, row)(*(q, v, a)[:given], **keywords)
            several = expected if isinstance(expected, tuple) else (expected,)
            out = tuple(card.array(np.full(x.shape, np.nan)) for x in several)
            found = getattr(fast, row)(*on[:given], **keywords, out=out if len(out) > 1 else out[0])
            for x, y in zip(found if isinstance(found, tuple) else (found,), several, strict=True):
                np.testing.assert_array_equal(x.host, y, err_msg=row)
            assert card["stream"] == 5 and card["card"] == 0 and card["blocks"] == -(-n // card["threads"])
        single = [card.array(x.astype(np.float32), card=1) for x in (q, v, a)]
        out = card.array(np.zeros((n, 6), np.float32), card=1)
        fast.inverse_dynamics(*single, out=out)
        np.testing.assert_array_equal(out.host, ur5.inverse_dynamics(*(x.host for x in single)))
        assert card["card"] == 1
        np.testing.assert_array_equal(fast.inverse_dynamics(q, v, a), ur5.inverse_dynamics(q, v, a))  # arrays of the processor, as before
    assert sorted(card.compiled) == ["sm_90", "sm_91"]
    assert fast.inverse_dynamics.__doc__ == ksl.Model.inverse_dynamics.__doc__


@pytest.mark.parametrize(
    ("best", "states_of", "blocks", "threads"), [(1024, 2000, 16, 128), (96, 2000, 21, 96), (1024, 500, 6, 96), (1024, 100, 4, 32), (96, 1, 1, 32)]
)
def test_blocks_occupy_the_card(card, ur5, best, states_of, blocks, threads):
    """By what the driver says of the kernel, and no larger than leaves a block to each of the five multiprocessors."""
    card.say(best=best)
    (q, v, a), out = states(ur5, states_of), card.array(np.zeros((states_of, 6)))
    ur5.compile(["inverse_dynamics"], device="cuda").inverse_dynamics(*(card.array(x) for x in (q, v, a)), out=out)
    assert (card["blocks"], card["threads"]) == (blocks, threads)
    np.testing.assert_array_equal(out.host, ur5.inverse_dynamics(q, v, a))


def test_rows_at_any_equal_distance_are_read_where_they_are(card, ur5):
    fast, (q, v, a) = ur5.compile(["inverse_dynamics"], device="cuda"), states(ur5, 40)
    wide, tau = card.array(np.zeros((40, 20))), card.array(np.zeros((5, 8, 6)))
    wide.host[:, 3:9] = v
    shaped = [card.array(q.reshape(5, 8, 6)), wide.view(np.s_[:, 3:9]), card.array(a[0])]
    shaped[1].host = shaped[1].host.reshape(5, 8, 6)
    assert shaped[1].host.base is not None
    fast.inverse_dynamics(*shaped, out=tau)
    np.testing.assert_array_equal(tau.host.reshape(40, 6), ur5.inverse_dynamics(q, v, a[0]))
    one = card.array(np.zeros(6))
    fast.inverse_dynamics(*(card.array(x[0]) for x in (q, v, a)), out=one)
    np.testing.assert_array_equal(one.host, ur5.inverse_dynamics(q[0], v[0], a[0]))
    backwards = [card.array(x).view(np.s_[::-1]) for x in (q, v)]
    out = card.array(a)
    fast.inverse_dynamics(*backwards, out, out=out)  # in place
    np.testing.assert_array_equal(out.host, ur5.inverse_dynamics(q[::-1], v[::-1], a))
    row = card.array(a[:1])
    fast.inverse_dynamics(card.array(q[0]), card.array(v[0]), row, out=row)  # one row, which has no distance
    np.testing.assert_array_equal(row.host, ur5.inverse_dynamics(q[0], v[0], a[:1]))
    before = card["launches"]
    memory = card.array(np.zeros(12)).host
    none = [FakeArray(card, memory[k:k].reshape(0, 6), 0, None) for k in range(4)]  # the start of each is where rows of the one before would be
    assert fast.inverse_dynamics(*none[:3], out=none[3]) is none[3] and card["launches"] == before
    with pytest.raises(ArgumentError, match=r"v: rows of shape \(40, 6\) with strides \(12, 2\) aren't at equal distances"):
        fast.inverse_dynamics(card.array(q), card.array(np.zeros((40, 12))).view(np.s_[:, ::2]), card.array(a), out=out)
    with pytest.raises(ArgumentError, match="out overlaps an argument"):
        memory = card.array(np.zeros(241)).host
        here, beyond = (FakeArray(card, memory[k : k + 240].reshape(40, 6), 0, None) for k in (0, 1))
        fast.inverse_dynamics(here, card.array(v), card.array(a), out=beyond)


def test_results_have_memory_of_the_library_of_the_arguments(card, ur5, monkeypatch):
    """As CuPy has `empty_like` and `full_like`."""
    library = type(sys)("cards")
    library.empty_like = lambda x, shape: type(x)(card, np.zeros(shape, x.host.dtype), x.card, x.stream)
    library.full_like = lambda x, number, shape: type(x)(card, np.full(shape, number, x.host.dtype), x.card, x.stream)
    monkeypatch.setitem(sys.modules, "cards", library)
    q, v, _ = states(ur5, 9)
    of_library = type("Array", (FakeArray,), {"__module__": "cards.core"})
    fast = ur5.compile(["inverse_dynamics"], device="cuda")
    tau = fast.inverse_dynamics(*(of_library(card, x, 0, None) for x in (q, v)), 0.5)
    np.testing.assert_array_equal(tau.host, ur5.inverse_dynamics(q, v, 0.5))
    with pytest.raises(ArgumentError, match=r"out is missing; results of FakeArray need .* of shape \(9, 6\)"):
        fast.inverse_dynamics(*(card.array(x) for x in (q, v, v)))
    of_jax = type("Array", (FakeArray,), {"__module__": "jaxlib._jax"})
    with pytest.raises(ArgumentError, match=r"ksl\.jax\.differentiable\(model\) has the calls for arrays of JAX"):
        fast.inverse_dynamics(*(of_jax(card, x, 0, None) for x in (q, v, v)))


class OfDlpack:
    """An array on a card that has DLPack's protocol alone."""

    def __init__(self, of, host):
        self.of, self.stream = of.array(host), None

    def __dlpack_device__(self):
        return 2, 0

    def __dlpack__(self, stream):
        self.stream = stream
        return self.of.host.__dlpack__()


class Said:
    """An array on a card whose interface says something else of it."""

    def __init__(self, of, **said):
        self.of, self.__cuda_array_interface__ = of, of.__cuda_array_interface__ | said


def test_arrays_of_dlpack(card, ur5):
    fast, (q, v, a), out = ur5.compile(["inverse_dynamics"], device="cuda"), states(ur5, 12), card.array(np.zeros((12, 6)))
    given = [OfDlpack(card, x) for x in (q, v, a[3])]
    fast.inverse_dynamics(*given, out=out)
    np.testing.assert_array_equal(out.host, ur5.inverse_dynamics(q, v, a[3]))
    assert [x.stream for x in given] == [1, 1, 1] and card["stream"] == 1  # the default one, which the library makes its numbers ready on
    given[0].stream, given[0].__cuda_array_interface__ = None, Said(card.array(q), version=2).__cuda_array_interface__
    fast.inverse_dynamics(*given, out=out)
    assert given[0].stream == 1  # an interface without a stream doesn't say when numbers are ready
    with pytest.raises(ArgumentError, match="an array of OfDlpack holds no floating-point numbers"):
        fast.inverse_dynamics(OfDlpack(card, np.zeros((12, 6), int)), *given[1:], out=out)


def test_wrenches_mimic_joints_and_other_models(card, ur5):
    fast, (q, v, a) = ur5.compile(["inverse_dynamics"], external=["tool0"], device="cuda"), states(ur5, 21)
    on, out, push = [card.array(x) for x in (q, v, a)], card.array(np.zeros((21, 6))), np.arange(6.0)
    fast.inverse_dynamics(*on, external={"tool0": card.array(push)}, out=out)
    np.testing.assert_array_equal(out.host, ur5.inverse_dynamics(q, v, a, external={"tool0": push}))
    for external in ({}, {"forearm_link": card.array(push)}):
        with pytest.raises(ArgumentError, match="the card's code is of tool0"):
            fast.inverse_dynamics(*on, external=external, out=out)
    lighter = fast.with_gravity((0, 0, -1.6))  # code has the gravity that it was made with
    assert lighter.compiled == () and "inverse_dynamics" not in vars(lighter)
    with pytest.raises(ValueError, match=r"q is on a card, .*device='cuda'"):
        lighter.inverse_dynamics(*on)
    assert pickle.loads(pickle.dumps(fast)).compiled == ()
    gripper = ksl.load_string(FOLLOWED)
    q, v, a = states(gripper, 11)
    out = card.array(np.zeros((11, gripper.nv)))
    gripper.compile(["inverse_dynamics"], device="cuda").inverse_dynamics(*(card.array(x) for x in (q, v, a)), out=out)
    np.testing.assert_array_equal(out.host, gripper.inverse_dynamics(q, v, a))


def test_what_does_not_fit_is_refused_by_name(card, ur5):
    fast, (q, v, a) = ur5.compile(["inverse_dynamics", "reactions:elbow", "energy"], device="cuda"), states(ur5, 4)
    q, v, a, out = (card.array(x) for x in (q, v, a, np.zeros((4, 6))))
    for given, keywords, sentence in (
        ((q, v.host, a), {}, "v is in the processor's memory, and other arguments are on a card"),
        ((q, card.array(v.host, card=1), a), {}, "q on cuda:0 and v on cuda:1; move all to one card"),
        ((q, v, card.array(a.host.astype("f4"))), {}, "q holds numbers of float64 and a of float32|v holds numbers of float64 and a of float32"),
        (tuple(card.array(x.host.astype("f4")) for x in (q, v, a)), {}, "arrays are of float32, .* compile with scalar='float', too"),
        ((q, card.array(np.zeros((4, 6), int)), a), {}, "v holds numbers of type <i8; expected float32 or float64"),
        ((q, card.array(np.zeros((4, 5))), a), {}, r"v has shape \(4, 5\); expected \(…, 6\): nv numbers for each state"),
        ((q, card.array(np.zeros((3, 6))), a), {}, r"leading shapes don't broadcast: q \(4, 6\), v \(3, 6\), a \(4, 6\)"),
        ((q, v, a), {"out": card.array(np.zeros((4, 5)))}, r"out is float64 \(4, 5\); expected a C-contiguous float64 array of shape \(4, 6\)"),
        ((q, v, a), {"out": card.array(np.zeros((4, 6)), card=1)}, "out is on cuda:1, and arguments are on cuda:0"),
        ((q, v, a), {"out": (out, out)}, "out is tuple; expected 1 arrays"),
        ((card.array(q.host, stream=5), card.array(v.host, stream=6), a), {"out": out}, "q and v are worked on in different streams"),
        ((card.array(q.host, stream=5), v, a), {"out": card.array(np.zeros((4, 6)), stream=6)}, "q and out are worked on in different streams"),
        ((0.0, 0.0, 0.0), {"out": out}, "out is on a card, and all arguments are numbers"),
        ((q, v, a), {"out": Said(out, data=(out.host.ctypes.data, True))}, "out is read-only"),
        ((q, Said(v, strides=(50, 8)), a), {"out": out}, r"v has strides of \(50, 8\) bytes, which are not whole numbers of 8 bytes"),
    ):
        with pytest.raises(ArgumentError, match=sentence):
            fast.inverse_dynamics(*given, **keywords)
    with pytest.raises(ArgumentError, match="out: two results share memory"):
        fast.energy(q, v, out=(memory := card.array(np.zeros(4)), memory))
    with pytest.raises(ArgumentError, match="reactions: the card's code answers reactions:elbow, and the call asks for something else"):
        fast.reactions(q, v, a, joints=["base"])
    with pytest.raises(TypeError, match="missing 1 required positional argument"):
        fast.inverse_dynamics(q, v)
    hidden = card.array(q.host)
    card.library.fake_free(hidden.host.ctypes.data)
    with pytest.raises(ArgumentError, match="q says that it is on a card, and its memory isn't"):
        fast.inverse_dynamics(hidden, v, a)
    with pytest.raises(ValueError, match="q is on a card"):
        fast.mass_matrix(q)
    for keywords, sentence in (
        ({"device": "gpu"}, "device='gpu': expected cpu, cuda"),
        ({"device": "cuda:2"}, "there are cards cuda:0 to cuda:1"),
        ({"device": "cuda", "compiler": "gcc"}, "compiled by NVRTC"),
    ):
        with pytest.raises(ArgumentError, match=sentence):
            ur5.compile(["energy"], **keywords)
    with pytest.raises(ArgumentError, match="unwritten"):
        ur5.compile(["mass_matrix_upper"], device="cuda")


@pytest.mark.parametrize(
    ("function", "code", "sentence"),
    [
        ("cuInit", 100, "there is no card that the driver can use"),
        ("cuInit", 803, "start the machine again"),
        ("cuDevicePrimaryCtxRetain", 2, r"CUDA_ERROR_OUT_OF_MEMORY: what the fake says \(2\); the card's memory is full"),
        ("cuDeviceGetAttribute", 3, "forked"),
        ("cuModuleLoadData", 209, "the code isn't for this card"),
        ("cuModuleGetFunction", 999, r"reports an unknown error \(999\)$"),
        ("cuLaunchKernel", 701, "compile for float"),
        ("cuLaunchKernel", 700, "started again"),
        ("cuLaunchKernel", 900, "once before the capture"),
    ],
)
def test_what_the_driver_reports_becomes_a_sentence(card, ur5, function, code, sentence):
    q = [card.array(x) for x in states(ur5, 2)]
    card.fail(function, code)
    with pytest.raises(CompilerError, match=sentence):
        ur5.compile(["bias"], device="cuda").bias(*q[:2], out=card.array(np.zeros((2, 6))))
    card.fail("", 0)
    ur5.compile(["bias"], device="cuda").bias(*q[:2], out=card.array(np.zeros((2, 6))))


def test_drivers_that_do_not_serve(card, ur5, monkeypatch, tmp_path):
    card.say(version=11080)
    with pytest.raises(CompilerError, match=r"serves CUDA 11\.8; KSL needs one that serves 12\.0"):
        ur5.compile(["energy"], device="cuda")
    card.say(version=12040, cards=0)
    with pytest.raises(CompilerError, match="no card"):
        ur5.compile(["energy"], device="cuda")
    card.say(cards=2)
    card.nvrtc(13, 2)
    monkeypatch.setenv("KSL_CACHE", str(tmp_path / "empty"))
    with pytest.raises(CompilerError, match=r"NVRTC 13\.2 makes code for drivers that serve CUDA 13, .* serves 12: .*nvidia-cuda-nvrtc-cu12"):
        ur5.compile(["energy"], device="cuda")
    assert not list((tmp_path / "empty").glob("failed*"))
    monkeypatch.setattr(drivers, "LIBRARIES", ("libno-such.so",))
    with pytest.raises(CompilerError, match="no driver of a card: .*needs an NVIDIA card and its driver"):
        Driver()
    with pytest.raises(CompilerError, match="no cuInit; KSL needs one that serves CUDA 12.0"):
        Driver("libm.so.6")


SECOND = """
import sys
sys.path[:0] = {paths!r}
import pathlib, numpy as np, ksl
from fake_card import FakeCard
card = FakeCard(pathlib.Path({folder!r}), setattr)
m = ksl.load({robot!r})
q, out = card.array(np.zeros((3, 6))), card.array(np.zeros((3, 6)))
m.compile(["gravity_torque"], device="cuda").gravity_torque(q, out=out)
assert (out.host == m.gravity_torque(q.host)).all()
print(len(card.compiled), card["modules"])
"""


def test_a_second_process_finds_the_code(card, folder, tmp_path):
    here = Path(__file__).parent
    text = SECOND.format(paths=[str(here)], folder=str(folder), robot=str(EXAMPLES / "ur5.urdf"))
    said = [
        subprocess.run(
            [sys.executable, "-c", text], capture_output=True, text=True, check=True, env=os.environ | {"KSL_CACHE": str(tmp_path / "own")}
        ).stdout.split()
        for _ in range(2)
    ]
    assert said == [["1", "1"], ["0", "1"]]
    assert len(list((tmp_path / "own").glob("*.cubin"))) == 1


def test_calls_leave_nothing_behind(card, ur5):
    fast, q = ur5.compile(["gravity_torque"], device="cuda"), card.array(states(ur5, 1)[0])
    out = card.array(np.zeros((1, 6)))
    modules, contexts = card["modules"], card["contexts"]

    def objects(calls):
        for _ in range(calls):
            fast.gravity_torque(q, out=out)
        gc.collect()
        return len(gc.get_objects())

    before = objects(100)
    assert objects(10_000) <= before + 20
    assert (card["modules"], card["contexts"]) == (modules, max(contexts, 1))
