"""`m.compile`: the model's own bits, whatever the call, and the model's own words; and the functions of many states that `ksl generate --lanes` writes."""

import ctypes
import pickle
import re

import numpy as np
import pytest
from generated_code import EXAMPLES, FLAGS, FOLLOWED, run

import ksl
from ksl.base.errors import ArgumentError, CompilerError
from ksl.generation import batches, cache, compiled, compiler, lanes_files
from ksl.generation.arguments import Arguments
from ksl.generation.batches import source
from ksl.generation.c99 import Printer
from ksl.generation.requests import functions_of

ROWS = [
    "inverse_dynamics",
    "forward_dynamics",
    "mass_matrix",
    "jacobian:tool0",
    "reactions:elbow+base",
    "energy",
    "inverse_dynamics_derivatives",
    "relative_pose:tool0+base_link",
    "point_velocity:tool0",
]


def states(m, n, dtype=np.float64, size=1.0):
    rng = np.random.default_rng(n)
    q = np.stack([m.random(k) for k in range(n)])
    return (q * size if m.nq == m.nv else q).astype(dtype), *(rng.normal(size=(n, m.nv)).astype(dtype) for _ in range(2))


CALLS = [
    ("inverse_dynamics", lambda m, q, v, a: m.inverse_dynamics(q, v, a)),
    ("forward_dynamics", lambda m, q, v, a: m.forward_dynamics(q, v, a)),
    ("mass_matrix", lambda m, q, v, a: m.mass_matrix(q)),
    ("jacobian", lambda m, q, v, a: m.jacobian(q, "tool0")),
    ("reactions", lambda m, q, v, a: m.reactions(q, v, a, joints=["elbow", "base"])),
    ("energy", lambda m, q, v, a: m.energy(q, v)),
    ("inverse_dynamics_derivatives", lambda m, q, v, a: m.inverse_dynamics_derivatives(q, v, a)),
    ("relative_pose", lambda m, q, v, a: m.relative_pose(q, "tool0", "base_link")),
    ("point_velocity", lambda m, q, v, a: m.point_velocity(q, v, "tool0", (0, 0, 0))),
]


def same(x, y):
    x, y = (r if isinstance(r, tuple) else (r,) for r in (x, y))
    return all(np.array_equal(a, b) and a.dtype == b.dtype for a, b in zip(x, y, strict=True))


@pytest.mark.parametrize(("row", "stores"), [("inverse_dynamics", "store"), ("mass_matrix", "store_chosen")])
def test_only_what_stores_results_is_written(ur5, row, stores):
    """Of a symmetric matrix a table chooses which number goes where; all other results are in order."""
    text, _ = source(functions_of(ur5, [row], Arguments(()), False, "least-norm"), "k_", "double", 4)
    assert [name for name in ("store", "store_chosen") if f"k_{name}(" in text] == [stores] and "k_all(0.0)" in text
    assert "k_all(0.0f)" in source(functions_of(ur5, [row], Arguments(()), True, "least-norm"), "k_", "float", 8)[0]


def test_numbers_of_long_functions_are_in_the_callers_memory(ur5, monkeypatch):
    """One array of six after the other."""
    monkeypatch.setattr("ksl.generation.batches.MOST_LOCAL", 0)
    for scalar, lanes, size in (("double", 4, 8), ("float", 8, 4)):
        text, memory = source(functions_of(ur5, ["inverse_dynamics"], Arguments(()), scalar == "float", "least-norm"), "k_", scalar, lanes)
        places = [int(place) for place in re.findall(r"memory \+ (\d+)", text)]
        assert places == sorted(places) and set(places) == {*range(0, places[-1] + 6, 6)} and memory == [(places[-1] + 6) * lanes * size]
    given = states(ur5, 33)
    assert same(ur5.compile(["inverse_dynamics"]).inverse_dynamics(*given), ur5.inverse_dynamics(*given))


def test_numbers_as_c_reads_them(ur5):
    (function,) = functions_of(ur5, ["energy"], Arguments(()), False, "least-norm")
    printed = [Printer(function.recording, "k_").literal(x) for x in (np.inf, -np.inf, np.nan, 1e-300, 1.5e-9, -2.0, 0.1)]
    assert printed == ["(1.0 / 0.0)", "(-1.0 / 0.0)", "(0.0 / 0.0)", "1.0e-300", "1.5e-09", "(-2.0)", "0.1"]


@pytest.mark.parametrize("name", ["clang", "gcc"])
@pytest.mark.parametrize(("scalar", "dtype"), [("double", np.float64), ("float", np.float32)])
def test_batches_of_all_lengths_have_the_bits_of_the_model(ur5, scalar, dtype, name):
    fast = ur5.compile(ROWS, scalar=scalar, compiler=name)
    assert fast.compiled == tuple(ROWS)
    for n, size in ((2, 1.0), (9, 1e5), (64, 30.0), (131, 1.0)):
        given = states(ur5, n, dtype, size)
        for row, call in CALLS:
            assert same(call(fast, *given), call(ur5, *given)), row


def test_it_is_the_code_that_computes(ur5, monkeypatch):
    written = compiled.source

    def planted(*given):
        text, memory = written(*given)
        assert text.count("tau[3] = ") == 1
        return text.replace("tau[3] = ", "tau[3] = 2.0 * "), memory

    monkeypatch.setattr(compiled, "source", planted)
    fast, given = ur5.compile(["inverse_dynamics"]), states(ur5, 20)
    assert np.array_equal(fast.inverse_dynamics(*given), ur5.inverse_dynamics(*given) * [1, 1, 1, 2, 1, 1])
    assert same(fast.inverse_dynamics(*(x[0] for x in given)), ur5.inverse_dynamics(*(x[0] for x in given)))  # one state, as before
    assert same(fast.inverse_dynamics(*given, external={"tool0": np.ones(6)}), ur5.inverse_dynamics(*given, external={"tool0": np.ones(6)}))
    lighter = fast.with_gravity((0, 0, -1.6))  # code has the gravity that it was made with
    assert lighter.compiled == () and same(lighter.inverse_dynamics(*given), ur5.with_gravity((0, 0, -1.6)).inverse_dynamics(*given))
    assert pickle.loads(pickle.dumps(fast)).compiled == ()


def test_calls_that_ask_for_something_else_are_the_models(ur5, monkeypatch):
    fast, (q, v, a) = ur5.compile("reactions:elbow,jacobian:tool0,frame_poses:tool0"), states(ur5, 12)
    for call in (
        lambda m: m.reactions(q, v, a, joints=["base"]),
        lambda m: m.reactions(q, v, a, joints=["elbow"], on="parent"),
        lambda m: m.reactions(q, v, a, joints=["elbow"], at=[0.1, 0, 0]),
        lambda m: m.reactions(q, v, a, joints=["elbow"], order="ang_lin"),
        lambda m: m.jacobian(q, "tool0", axes="world"),
        lambda m: m.jacobian(q, "forearm_link"),
        lambda m: m.frame_poses(q, ["forearm_link", "tool0"]),
        lambda m: m.frame_poses(q.astype(np.float32), ["tool0"]),
    ):
        assert same(call(fast), call(ur5))


def test_threads_memory_of_results_and_shapes_are_those_of_calls(ur5):
    fast, (q, v, a) = ur5.compile(["inverse_dynamics"]), states(ur5, 1000)
    expected = ur5.inverse_dynamics(q, v, a)
    assert same(fast.inverse_dynamics(q, v, a, threads=2), expected)
    assert same(fast.inverse_dynamics(q.reshape(10, 100, 6), v.reshape(10, 100, 6), a.reshape(10, 100, 6)), expected.reshape(10, 100, 6))
    wide = np.zeros((1000, 20))
    wide[:, 3:9] = v
    assert same(fast.inverse_dynamics(q, wide[:, 3:9], a), expected)
    there = a.copy()
    assert same(fast.inverse_dynamics(q, v, there, out=there), expected)
    assert same(fast.inverse_dynamics(q[0], v, a), ur5.inverse_dynamics(q[0], v, a))
    q[17, 2] = np.nan
    with pytest.raises(ValueError, match=r"q\[17, 2\] is nan"):
        fast.inverse_dynamics(q, v, a)
    q[17, 2], v[500] = 0, 1e200
    messages = []
    for m in (ur5, fast):
        with pytest.raises(ksl.ResultError) as e:
            m.inverse_dynamics(q, v, a)
        messages.append(str(e.value))
    assert messages[0] == messages[1] and "500" in messages[0]


def test_slides_alone_need_no_sines():
    b = ksl.Builder("gantry").add_link("bed").add_link("bridge", 8.0, (0, 0.1, 0), np.eye(3)).add_link("head", 2.0, (0, 0, 0.2), np.eye(3))
    m = b.add_joint("x", "prismatic", "bed", "bridge", axis=(1, 0, 0)).add_joint("z", "prismatic", "bridge", "head", axis=(0, 0.6, 0.8)).build()
    given = states(m, 20)
    assert same(m.compile(["inverse_dynamics"]).inverse_dynamics(*given), m.inverse_dynamics(*given))


def test_wrenches_and_mimic_joints(ur5):
    fast, given = ur5.compile(["inverse_dynamics"], external=["tool0", "forearm_link"]), states(ur5, 21)
    push = {"tool0": np.random.default_rng(1).normal(size=(21, 6)), "forearm_link": np.arange(6.0)}
    assert same(fast.inverse_dynamics(*given, external=push), ur5.inverse_dynamics(*given, external=push))
    gripper = ksl.load_string(FOLLOWED)
    given = states(gripper, 11)
    for row in ("inverse_dynamics", "forward_dynamics", "mass_matrix"):
        call = dict(CALLS)[row]
        assert same(call(gripper.compile([row]), *given), call(gripper, *given))


def test_closed_mechanisms_take_the_pivots_of_the_state_where_those_of_the_code_are_none():
    m = ksl.load(EXAMPLES / "excavator.urdf")
    rng, q = np.random.default_rng(3), []
    while len(q) < 64:
        found = m.close(m.integrate(m.close(m.neutral()).q, rng.normal(size=m.nv) * 0.2))
        if found.converged:
            q.append(found.q)
    given = {"given": m.independent(q[0])}
    v = np.stack([m.consistent_velocity(x, rng.normal(size=m.nv), **given) for x in q])
    a = np.stack([m.consistent_acceleration(x, y, rng.normal(size=m.nv), **given) for x, y in zip(q, v)])
    rows = ("inverse_dynamics", "reactions", "forward_dynamics", "inverse_dynamics_regressor", "inverse_dynamics_derivatives")
    fast = m.compile(rows)
    for row in rows:
        assert same(getattr(fast, row)(np.array(q), v, a), getattr(m, row)(np.array(q), v, a)), row
    with pytest.raises(ValueError, match="mass_matrix"):
        m.compile(["mass_matrix"])
    with pytest.raises(ValueError, match="forward_dynamics can't be generated in float for a closed mechanism; ask for double"):
        m.compile(["forward_dynamics"], scalar="float")


def test_large_derivatives_of_closed_mechanisms_have_the_bits_of_one_state():
    """Beyond 1e10 the engine looks at a state again, by pivots of its own: in batches and in code, too."""
    m, rng = ksl.load(EXAMPLES / "excavator.urdf"), np.random.default_rng(1)
    fast, rows = m.compile(["inverse_dynamics_derivatives"]), [[], [], []]
    start = m.close(m.neutral()).q
    for speed in np.geomspace(1, 1e7, 20):
        q = m.close(m.integrate(start, rng.normal(size=m.nv) * 0.1)).q
        v = m.consistent_velocity(q, speed * rng.normal(size=m.nv), given=m.independent(q))
        for x, to in zip((q, v, m.consistent_acceleration(q, v, rng.normal(size=m.nv), given=m.independent(q))), rows):
            to.append(x)
    q, v, a = map(np.array, rows)
    alone = tuple(map(np.array, zip(*(m.inverse_dynamics_derivatives(*x) for x in zip(q, v, a)))))
    assert np.abs(alone[0][-1]).max() > 1e10 > np.abs(alone[0][0]).max()
    assert same(alone, m.inverse_dynamics_derivatives(q, v, a)) and same(alone, fast.inverse_dynamics_derivatives(q, v, a))


def test_what_is_not_compiled_is_refused_with_its_name(ur5):
    for m, row, sentence in (
        (ur5, "mass_matrix_upper", "unwritten"),
        (ksl.load(EXAMPLES / "four_bar_knee.urdf"), "reactions_derivatives:hip_pitch", "put together by the library"),
        (ur5, "vjp.energy", "ksl.generate"),
        (ur5, "inverse_dynamic", "did you mean inverse_dynamics"),
    ):
        with pytest.raises(ArgumentError, match=sentence):
            m.compile([row])
    with pytest.raises(ArgumentError, match="scalar='half'"):
        ur5.compile(["energy"], scalar="half")
    with pytest.raises(ArgumentError, match="lanes=3: expected one of 2, 4, 8, 16, or 0 for none"):
        ksl.generate(ur5, ["energy"], "x", lanes=3)


def test_the_cache_holds_what_was_compiled_and_only_the_users_own(ur5, tmp_path, monkeypatch):
    monkeypatch.setenv("KSL_CACHE", str(tmp_path / "code"))
    count, compile_ = [], compiler.Compiler.compile
    monkeypatch.setattr(compiler.Compiler, "compile", lambda *given: (count.append(1), compile_(*given)))
    given = states(ur5, 10)
    expected = ur5.energy(given[0], given[1])
    for _ in range(2):
        assert same(ur5.compile(["energy"]).energy(given[0], given[1]), expected)
    assert len(count) == 1 and (tmp_path / "code").stat().st_mode & 0o777 == 0o700
    (library,) = (tmp_path / "code").glob(f"*{cache.SUFFIX}")
    damaged = library.read_bytes()[:1000]
    library.unlink()  # it is loaded
    library.write_bytes(damaged)
    assert same(ur5.compile(["energy"]).energy(given[0], given[1]), expected) and len(count) == 2
    (tmp_path / "code").chmod(0o777)  # others could have put code there
    assert same(ur5.compile(["energy"]).energy(given[0], given[1]), expected) and len(count) == 3
    library.unlink()
    library.mkdir()
    with pytest.raises(CompilerError, match="make room there, or name another folder for compiled code in the variable KSL_CACHE"):
        ur5.compile(["energy"])
    library.rmdir()
    monkeypatch.setattr(cache, "MOST_BYTES", 0)
    ur5.compile(["mass_matrix"])
    assert len(list((tmp_path / "code").glob(f"*{cache.SUFFIX}"))) == 1  # the oldest went
    assert cache._is_whole(next((tmp_path / "code").glob(f"*{cache.SUFFIX}")))
    monkeypatch.setattr(cache.os, "getuid", lambda: 12345)
    assert not cache._is_whole(next((tmp_path / "code").glob(f"*{cache.SUFFIX}")))
    with pytest.raises(CompilerError, match="belongs to somebody else"):
        ur5.compile(["energy"])


@pytest.mark.parametrize(("mode", "stays"), [(0o700, True), (0o710, True), (0o740, True), (0o704, True), (0o701, True), (0o720, False), (0o702, False)])
def test_a_cache_that_others_could_write_to_is_emptied(tmp_path, monkeypatch, mode, stays):
    monkeypatch.setenv("KSL_CACHE", str(tmp_path))
    (tmp_path / "code").write_text("")
    tmp_path.chmod(mode)
    assert cache.cache_folder() == tmp_path and tmp_path.stat().st_mode & 0o777 == 0o700 and (tmp_path / "code").exists() == stays


@pytest.mark.parametrize(("most", "but", "stay"), [(300, 2, "012"), (299, 2, "12"), (200, 2, "12"), (199, 2, "2"), (200, 0, "02")])
def test_what_was_used_longest_ago_goes_first(tmp_path, monkeypatch, most, but, stay):
    for k in range(3):
        (tmp_path / f"{k}{cache.SUFFIX}").write_bytes(bytes(100))
        (tmp_path / f"{k}.sha256").write_text("")
        cache.os.utime(tmp_path / f"{k}{cache.SUFFIX}", (k, k))
    monkeypatch.setattr(cache, "MOST_BYTES", most)
    cache._forget_oldest(tmp_path, tmp_path / f"{but}{cache.SUFFIX}")
    assert "".join(sorted(f.stem for f in tmp_path.glob(f"*{cache.SUFFIX}"))) == "".join(sorted(f.stem for f in tmp_path.glob("*.sha256"))) == stay


def test_where_code_is_kept_and_how_it_is_compiled_on_each_system(monkeypatch):
    home = cache.Path.home()
    for system, variables, folder in (
        ("linux", {}, home / ".cache/ksl/code"), ("linux", {"XDG_CACHE_HOME": "/c"}, "/c/ksl/code"), ("darwin", {"XDG_CACHE_HOME": "/c"}, home / "Library/Caches/ksl/code"),
        ("win32", {}, home / "AppData/Local/ksl/code"), ("win32", {"LOCALAPPDATA": "/l"}, "/l/ksl/code"),
    ):  # fmt: skip
        monkeypatch.setattr(cache.sys, "platform", system)
        monkeypatch.setattr(cache.os, "environ", {"HOME": str(home), **variables})
        assert cache._usual() == cache.Path(folder)
    wide = "-mprefer-vector-width=512"
    for instructions, command, version, flags in (
        ("x86-64-v4", "cc", "gcc 12", ["-march=x86-64-v4", wide]), ("x86-64-v3", "cc", "gcc 12", ["-march=x86-64-v3"]), ("neon", "cc", "gcc 12", []),
        ("x86-64-v4", "ziglang", "clang 16", ["-mcpu=x86_64_v4", wide]), ("x86-64-v3", "cc", "zig cc 0.13", ["-mcpu=x86_64_v3"]),
    ):  # fmt: skip
        monkeypatch.setattr(compiler._core, "instruction_set", lambda now=instructions: now)
        assert compiler.Compiler((command,), version).flags() == [*compiler.PLAIN, *flags]


def test_without_a_compiler_it_says_what_brings_one(ur5, tmp_path, monkeypatch):
    with pytest.raises(CompilerError, match="no compiler 'no-such-cc'"):
        ur5.compile(["energy"], compiler="no-such-cc")
    with pytest.raises(CompilerError, match="seems to be no compiler"):
        ur5.compile(["energy"], compiler="false")
    with pytest.raises(CompilerError, match="no compiler ' '"):
        ur5.compile(["energy"], compiler=" ")
    broken = tmp_path / "cc"
    for end, said in (("exit 3", "ended with status 3"), ("exit 0", "ended with status 0"), ("kill -9 $$", "was ended by signal 9")):
        broken.write_text(f"#!/bin/sh\n[ \"$1\" = --version ] && echo broken 1.0 && exit 0\necho 'no memory left' >&2\n{end}\n")
        broken.chmod(0o700)
        with pytest.raises(CompilerError, match=f"(?s){said} for .*failed-.*which is kept.*no memory left"):
            ur5.compile(["energy"], compiler=str(broken))
    monkeypatch.setenv("PATH", str(tmp_path / "nothing"))
    monkeypatch.setattr(compiler, "find_spec", lambda name: None)
    with pytest.raises(CompilerError, match=r"pip install 'ksl\[compile\]'"):
        ur5.compile(["energy"])


@pytest.mark.parametrize("scalar", ["double", "float"])
def test_generated_functions_of_many_states_agree_with_the_engine(ur5, tmp_path, scalar):
    algorithms = ["inverse_dynamics", "reactions", "energy", "jacobian:tool0"]
    for lanes, name, march in ((8, "clang", "x86-64-v3"), (4, "gcc", "x86-64-v3"), (2, "gcc", "x86-64")):
        folder = tmp_path / f"{lanes}{name}"
        ksl.generate(ur5, algorithms, folder, name="last", scalar=scalar, arguments=["external:tool0+elbow", "gravity"], lanes=lanes)
        run(name, *FLAGS, f"-march={march}", "last.c", "last_lanes.c", "last_test.c", "-o", "test", "-lm", cwd=folder)
        assert run(folder / "test", cwd=folder) == "all results agree\n"
    page = (EXAMPLES.parents[1] / "docs" / "c_code.md").read_text(encoding="utf-8")
    declared = next(line for line in page.splitlines() if line.startswith("void ur5_lanes_")).partition(" //")[0]
    ksl.generate(ur5, ["inverse_dynamics"], tmp_path / "page", name="ur5", lanes=8)
    assert declared in (tmp_path / "page" / "ur5_lanes.h").read_text()
    run("gcc", *FLAGS, "-march=x86-64", "-fPIC", "-shared", "last_lanes.c", "-o", "code.so", "-lm", cwd=folder)
    code, (q, v, _) = ctypes.CDLL(str(folder / "code.so")), states(ur5, 7, np.float64 if scalar == "double" else np.float32)
    gravity, kinetic, potential = np.tile(np.array([1, 2, -3], q.dtype), (7, 1)), np.empty(7, q.dtype), np.empty(7, q.dtype)
    code.last_lanes_energy(ctypes.c_size_t(7), *(ctypes.c_void_p(x.ctypes.data) for x in (q, v, gravity, kinetic, potential)))
    assert same((kinetic, potential), ur5.with_gravity((1, 2, -3)).energy(q, v))


def test_headers_say_the_stack_of_many_states_and_what_is_too_much_is_refused(ur5, tmp_path, monkeypatch):
    for most in (batches.MOST_STACK, 1 << 17):
        monkeypatch.setattr(batches, "MOST_STACK", most)
        ksl.generate(ur5, ["inverse_dynamics_derivatives"], tmp_path, name="p", lanes=4)
        said = int((tmp_path / "p_lanes.h").read_text().split(" bytes of stack")[0].split()[-1].replace(",", ""))
        run("gcc", "-O2", "-ffp-contract=off", "-Wno-psabi", "-march=x86-64-v3", "-fstack-usage", "-c", "p_lanes.c", cwd=tmp_path)
        taken = max(int(line.split("\t")[1]) for line in (tmp_path / "p_lanes.su").read_text().splitlines())
        assert said <= min(taken, most) and taken < said + 2000
        run("gcc", *FLAGS, "-march=x86-64-v3", "p.c", "p_lanes.c", "p_test.c", "-o", "test", "-lm", cwd=tmp_path)
        assert run(tmp_path / "test", cwd=tmp_path) == "all results agree\n"
    monkeypatch.setattr(lanes_files, "LARGEST_STACK", said - 1)
    with pytest.raises(ArgumentError, match=f"lanes=4: inverse_dynamics_derivatives of this robot takes {said:,} bytes of stack"):
        ksl.generate(ur5, ["inverse_dynamics_derivatives"], tmp_path, name="p", lanes=4)


def test_operators_of_jax_run_the_code(ur5):
    jax = pytest.importorskip("jax")
    ksl_jax = pytest.importorskip("ksl.jax")
    with jax.enable_x64(True):
        fast, (q, v, a) = ur5.compile(["inverse_dynamics"]), states(ur5, 40)
        of = ksl_jax.differentiable(fast)
        assert np.array_equal(of.inverse_dynamics(q, v, a), ur5.inverse_dynamics(q, v, a))
        gradient = jax.grad(lambda x: of.inverse_dynamics(x, v, a).sum())(q)
        assert np.array_equal(gradient, jax.grad(lambda x: ksl_jax.differentiable(ur5).inverse_dynamics(x, v, a).sum())(q))
