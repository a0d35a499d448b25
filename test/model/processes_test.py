"""Threads against the rest of the process: cores that it may use, forks and exits during batches, subinterpreters, memory that runs out."""

import os
import subprocess
import sys

import pytest

MODEL = """
import os, sys, threading
import numpy as np, ksl
m = ksl.load(sys.argv[1])
q, v, a = np.random.default_rng(1).uniform(-2, 2, (3, 20000, m.nv))
threads = lambda: len(os.listdir("/proc/self/task"))
"""

BUSY = """
def busy(called):
    while True:
        m.inverse_dynamics(q, v, a, threads=2)
        called.set()
for called in [threading.Event(), threading.Event()]:
    threading.Thread(target=busy, args=(called,), daemon=True).start()
    called.wait()
"""

SLOWER = 5 if "san" in os.environ.get("LD_PRELOAD", "") else 1
"""How many times as long programs may take: with a sanitizer they are slow."""


def run(code, examples, timeout=300 * SLOWER):
    return subprocess.run([sys.executable, "-W", "ignore", "-c", code, examples / "robots/panda.urdf"], capture_output=True, text=True, timeout=timeout)


def output(code, examples):
    done = run(code, examples)
    assert done.returncode == 0 and done.stderr == "", done.stderr
    return done.stdout.strip()


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="Linux only")
@pytest.mark.parametrize("asked", [None, 100_000])
def test_no_more_threads_than_cores_that_the_process_may_use(examples, asked):
    cores = sorted(os.sched_getaffinity(0))[:2]
    for n in range(1, len(cores) + 1):  # bound to so many
        code = f"import os; os.sched_setaffinity(0, {cores[:n]})\n" + MODEL
        code += f"before = threads(); m.inverse_dynamics(q, v, a, threads={asked}); print(threads() - before)"
        assert int(output(code, examples)) <= n - 1


def test_forks_during_batches(examples):
    """Children compute, in whatever place the fork finds the threads of the parent; the parent goes on."""
    code = MODEL + BUSY
    code += """
q, v, a = q[:3000], v[:3000], a[:3000]
alone = m.inverse_dynamics(q, v, a, threads=1)
same = lambda: np.array_equal(m.inverse_dynamics(q, v, a, threads=2), alone)
codes = set()
for _ in range(220):
    child = os.fork()
    if child == 0:
        os._exit(0 if same() else 1)
    codes.add(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
print(codes, same(), flush=True)
os._exit(0)
"""
    assert (
        output(code.replace("import os,", f"import faulthandler; faulthandler.dump_traceback_later({250 * SLOWER}, exit=True)\nimport os,", 1), examples)
        == "{0} True"
    )


@pytest.mark.parametrize("end, status", [("sys.exit(3)", 3), ("os._exit(4)", 4), ("raise SystemExit(5)", 5), ("pass", 0)])
def test_the_program_ends_during_batches(examples, end, status):
    done = run(MODEL + BUSY + end, examples)
    assert (done.returncode, done.stderr) == (status, "")


def test_a_subinterpreter_is_refused_with_a_sentence(examples):
    code = """
try:
    import _interpreters as interpreters
except ImportError:
    import _xxsubinterpreters as interpreters
import sys, ksl
ksl.load(sys.argv[1])
interpreters_code = '''
import sys, warnings
warnings.simplefilter("ignore")
sys.path[:] = %r
try:
    import ksl
    ksl.load(%r)
    print("imported", flush=True)
except ImportError as error:
    print(error, flush=True)
''' % (sys.path, sys.argv[1])
other = interpreters.create() if hasattr(interpreters, "get_main") else interpreters.create("legacy")
interpreters.run_string(other, interpreters_code)
ksl.load(sys.argv[1])
"""
    if sys.version_info >= (3, 13):
        pytest.skip("NumPy itself is refused there")
    assert "subinterpreter" in output(code, examples)


def test_memory_that_runs_out_is_a_memory_error(examples):
    code = (
        MODEL
        + """
import resource
from pathlib import Path
text = Path(sys.argv[1]).read_text()
before = m.inverse_dynamics(q[0], v[0], a[0])
size = int(open("/proc/self/statm").read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
resource.setrlimit(resource.RLIMIT_AS, (size + (64 << 20), -1))
for call in (lambda: m.mass_matrix_inverse(np.broadcast_to(q[0], (10**9, m.nv))), lambda: ksl.load_string(text + "<!--" + 200 * 10**6 * "x" + "-->")):
    try:
        call()
    except MemoryError:
        print("MemoryError")
assert np.array_equal(m.inverse_dynamics(q[0], v[0], a[0]), before)
"""
    )
    assert output(code, examples).split() == ["MemoryError"] * 2
