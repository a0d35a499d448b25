"""Precision, threads, `out=`, and one result for every instruction set."""

import os
import subprocess
import sys

import numpy as np
import pytest

import ksl

HASH = """
import hashlib, sys
import numpy as np, ksl
m = ksl.load(sys.argv[1], floating_base=True)
rng = np.random.default_rng(5)
q, v, a = rng.normal(size=(37, m.nq)), rng.normal(size=(37, m.nv)), rng.normal(size=(37, m.nv))
q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
digest = hashlib.sha256()
for dtype in (np.float64, np.float32):
    s = [x.astype(dtype) for x in (q, v, a)]
    efforts = m.inverse_dynamics(*s), m.forward_dynamics(*s), m.mass_matrix(s[0]), m.reactions(*s, part="constraint", axes="world")
    for x in (*efforts, m.frame_poses(s[0]), *m.energy(*s[:2])):
        digest.update(x.tobytes())
print(digest.hexdigest())
"""


@pytest.fixture
def panda(examples):
    return ksl.load(examples / "robots/panda.urdf")


def states(m, n, dtype=np.float64):
    rng = np.random.default_rng(1)
    return rng.uniform(-2, 2, (3, n, m.nv)).astype(dtype)


def test_every_instruction_set_gives_the_same_bits(examples):
    def digest(isa):
        run = subprocess.run([sys.executable, "-c", HASH, examples / "robots/panda.urdf"], capture_output=True, text=True, env=os.environ | {"KSL_ISA": isa})
        return run.stdout.strip() if run.returncode == 0 else run.stderr

    found = {isa: digest(isa) for isa in ("x86-64-v2", "x86-64-v3", "x86-64-v4")}
    ran = {isa: d for isa, d in found.items() if "is no instruction set that runs here" not in d}
    assert "x86-64-v2" in ran
    assert len(set(ran.values())) == 1, found
    assert len(ran["x86-64-v2"]) == 64


@pytest.mark.parametrize("n", [1, 3, 37, 3000])
def test_out_may_be_an_argument(panda, n):
    for call in (panda.inverse_dynamics, panda.forward_dynamics):
        expected = call(*states(panda, n))
        for k in range(3):
            given = [x.copy() for x in states(panda, n)]
            assert call(*given, out=given[k]) is given[k]
            assert np.array_equal(given[k], expected)


@pytest.mark.parametrize("shift", [-7, -1, 1, 7])
def test_an_out_that_overlaps_an_argument_otherwise_is_refused(panda, shift):
    n = 40
    for k, name in enumerate("qva"):
        given = [x.copy() for x in states(panda, n)]
        memory = np.zeros((n + 2) * 7)
        given[k] = memory[7 : 7 + n * 7].reshape(n, 7)
        out = memory[7 + shift : 7 + shift + n * 7].reshape(n, 7)
        with pytest.raises(ValueError, match=f"out overlaps {name}, which would be overwritten.* give out={name} itself or memory apart"):
            panda.inverse_dynamics(*given, out=out)
    memory = np.zeros(n * 49)
    with pytest.raises(ValueError, match="out overlaps q"):
        panda.mass_matrix(memory[: n * 7].reshape(n, 7), out=memory.reshape(n, 7, 7))


def test_an_out_beside_an_argument_is_filled(panda):
    q, v, a = states(panda, 12)
    memory = np.concatenate([a, np.zeros_like(a)])
    assert np.array_equal(panda.inverse_dynamics(q, v, memory[:12], out=memory[12:]), panda.inverse_dynamics(q, v, a))
    assert np.array_equal(panda.inverse_dynamics(q, v, memory[:1], out=memory[:12]), panda.inverse_dynamics(q, v, a[:1])), "a is broadcast: a copy"


def test_threads_are_counted(panda):
    q, v, a = states(panda, 12)
    for call in (panda.inverse_dynamics, panda.forward_dynamics, panda.reactions):
        assert np.array_equal(call(q, v, a, threads=0), call(q, v, a, threads=None))
        with pytest.raises(ValueError, match="threads=-1; expected.*None or 0 for all cores"):
            call(q, v, a, threads=-1)
    with pytest.raises(ValueError, match="threads=-2"):
        panda.mass_matrix(q, threads=-2)
    with pytest.raises(ValueError, match="threads=1.5; expected how many threads"):
        panda.inverse_dynamics(q, v, a, threads=1.5)


def test_short_names(panda):
    q, v, a = states(panda, 3)
    assert np.array_equal(panda.rnea(q, v, a), panda.inverse_dynamics(q, v, a))
    assert np.array_equal(panda.aba(q, v, a), panda.forward_dynamics(q, v, a))
    assert np.array_equal(panda.crba(q), panda.mass_matrix(q))
