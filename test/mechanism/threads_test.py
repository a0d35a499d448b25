"""Threads that are kept: several callers at once, forks, the end of the program, and the interpreter's lock."""

import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import ksl
from ksl import ufuncs

STATES = """
import os, sys, threading
import numpy as np, ksl
m = ksl.load(sys.argv[1])
before = len(os.listdir("/proc/self/task"))
q, v, a = np.random.default_rng(1).uniform(-2, 2, (3, 20000, m.nv))
alone = m.inverse_dynamics(q, v, a, threads=1)
same = lambda: np.array_equal(m.inverse_dynamics(q, v, a, threads=3), alone)
assert same()
"""

FORKS = """
def busy():
    while not done:
        m.inverse_dynamics(q, v, a, threads=2)
done = False
others = [threading.Thread(target=busy) for _ in range(2)]
for t in others: t.start()
children = []
for _ in range(12):
    child = os.fork()
    if child == 0:
        os._exit(0 if same() and same() else 1)
    children.append(child)
codes = [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children]
done = True
for t in others: t.join()
assert same()
print(codes)
"""

GRANDCHILDREN = """
def generations(left):
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    os._exit((0 if same() else 1) or (left and generations(left - 1)))
print(generations(3))
"""


SHARED = """
from ksl import ufuncs
ufuncs.set_threads(3)
count = lambda: len(os.listdir("/proc/self/task"))
after_dynamics = count()
D, c = np.zeros((300_000, 4, 3)), np.zeros((300_000, 6))
ufuncs.product_CoAdc(D, c)
print(after_dynamics - before, "more, then", count() - after_dynamics, "more")
"""

DAEMON = """
from ksl import ufuncs
force = {m.link_names[-1]: np.zeros((len(q), 6))}
D, c = np.ones((300_000, 4, 3)), np.ones((300_000, 6))
calls = [
    lambda: m.inverse_dynamics(q, v, a), lambda: m.inverse_dynamics(q, v, a, threads=1), lambda: m.inverse_dynamics(q, v[0], a, external=force),
    lambda: m.reactions(q, v, a), lambda: m.forward_dynamics(q, v, a), lambda: m.mass_matrix(q), lambda: m.frame_poses(q), lambda: m.energy(q, v),
    lambda: ufuncs.product_CoAdc(D, c),
]
def call_for_ever(call):
    while True:
        call()
        called.set()
called, codes = threading.Event(), []
for call in calls * 3:
    child = os.fork()
    if not child:  # which ends as any program does
        threading.Thread(target=call_for_ever, args=(call,), daemon=True).start()
        called.wait()
        break
    codes.append(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
else:
    print(codes)
"""


@pytest.fixture
def panda(examples):
    return ksl.load(examples / "robots/panda.urdf")


def states(m, n):
    return np.random.default_rng(1).uniform(-2, 2, (3, n, m.nv))


def program(code, examples):
    run = subprocess.run([sys.executable, "-W", "ignore", "-c", STATES + code, examples / "robots/panda.urdf"], capture_output=True, text=True, timeout=300)
    assert run.returncode == 0 and run.stderr == "", run.stderr
    return run.stdout.strip()


@pytest.mark.parametrize("n", [300, 1299, 4097, 20_000])
@pytest.mark.parametrize("threads", [2, 3, 7, 40])
def test_any_number_of_threads_gives_the_same_bits(panda, n, threads):
    q, v, a = states(panda, n)
    for call, given in ((panda.inverse_dynamics, (q, v, a)), (panda.forward_dynamics, (q, v, a)), (panda.mass_matrix, (q,)), (panda.reactions, (q, v, a))):
        assert np.array_equal(call(*given, threads=threads), call(*given, threads=1))


def test_many_callers_at_once(panda):
    q, v, a = states(panda, 6000)
    D, c = np.random.default_rng(2).normal(size=(70_000, 4, 3)), np.random.default_rng(3).normal(size=(70_000, 6))
    work = [
        (lambda: panda.inverse_dynamics(q, v, a, threads=3), panda.inverse_dynamics(q, v, a, threads=1)),
        (lambda: panda.mass_matrix(q[:2000], threads=2), panda.mass_matrix(q[:2000], threads=1)),
        (lambda: ufuncs.product_CoAdc(D, c), np.concatenate([ufuncs.product_CoAdc(D[k::2], c[k::2])[:, None] for k in (0, 1)], axis=1).reshape(-1, 6)),
    ]
    with ThreadPoolExecutor(6) as callers:
        found = list(callers.map(lambda k: np.array_equal(work[k % 3][0](), work[k % 3][1]), range(120)))
    assert all(found)


def test_array_functions_and_dynamics_share_their_threads(examples):
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 3
    more = int(program(SHARED, examples).replace(" more, then 0 more", ""))
    assert (cores > 1) <= more <= min(3, cores) - 1  # a quota may leave fewer


def test_a_child_of_a_fork_has_threads_of_its_own(examples):
    assert program(FORKS, examples) == str([0] * 12)


def test_children_of_children_too(examples):
    assert program(GRANDCHILDREN, examples) == "0"


def test_the_program_ends_while_threads_wait_or_work(examples):
    program("sys.exit(0)", examples)
    program("os._exit(0)", examples)


def test_the_program_ends_while_a_daemon_thread_calls(examples):
    """Each of nine calls several times, for the end may find the thread in any place."""
    assert program(DAEMON, examples) == str([0] * 27)


def test_other_python_threads_run_during_a_batch(panda):
    """One of them sees the first results of a batch before the last ones are there.  With the interpreter's lock held it never could."""
    q, v, a = states(panda, 300_000)
    out, seen, done = np.zeros_like(v), threading.Event(), threading.Event()
    ends = out[:: len(out) - 1]

    def look():
        while not done.is_set():
            first, last = ends.copy()  # one call: nothing of Python comes between
            if np.isfinite(first).all() and np.isnan(last).any():
                seen.set()

    other = threading.Thread(target=look)
    other.start()
    try:
        for _ in range(50):  # on a busy machine the other thread may get no time during a batch
            ends[:] = np.nan
            panda.inverse_dynamics(q, v, a, out=out, threads=1)
            if seen.is_set():
                break
    finally:
        done.set()
        other.join()
    assert seen.is_set()
