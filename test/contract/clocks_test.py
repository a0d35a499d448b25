"""No test judges by a clock: machines differ, and other programs take their time.

Times are benchmarks (bench/).  A test counts what grows (test/growth.py), waits for an event, and names no clock.  The files below do, for a
reason that is no judgement: a deadline that ends a hang, or a moment at which something is stopped whose result is right at every moment."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

CLOCK = re.compile(
    r"\b(?:perf_counter|process_time|thread_time|monotonic|time\.time|timeit|getrusage\(resource\.RUSAGE_SELF\)\.ru_[us]time|os\.times"  # Python
    r"|sleep|wait_for_timeout|datetime\.now|pytest\.mark\.timeout"
    r"|(?:steady|system|high_resolution)_clock|std::clock|clock_gettime|gettimeofday|CLOCKS_PER_SEC|sleep_for|usleep|nanosleep|wait_for\(|wait_until)(?:_ns)?\b"  # C and C++
)
"""What reads a clock, or waits by it.  A `timeout=` of a process or a page, and alarm(), end what hangs."""

REASONS = {
    "test/base/own_process_test.py": "programs that sleep until they are ended",
    "test/contract/environment_test.py": "commands that run side by side and end in a known order",
    "test/cli/cli_outputs_test.py": "deadline of a wait for a file that a process writes",
    "test/cli/hostile_commands_test.py": "programs that sleep until an interrupt comes",
    "test/faults/ended_sweeps.py": "moments at which runs are stopped",
    "test/faults/kill_at_random.py": "moments at which runs are stopped",
    "test/faults/killing.py": "moments at which runs are stopped",
    "test/faults/threads_fault_test.cpp": "moments at which programs exit; deadline of a wait for a thread",
    "test/motions/generate/generate_test.py": "counts in the place of a clock",
    "test/mutate/driver.cpp": "no test: how long mutants take, and when they hang",
    "test/mutate/python_tests.py": "no test: how long mutants take, and when they hang",
    "test/mutate/run.py": "no test: how long a run took, for its report",
    "test/sweeps/sweep_results_test.py": "counts in the place of a clock",
    "test/sweeps/sweep_workers_test.py": "deadline of a wait for a process",
    "test/viewer/hostile_names_test.py": "deadline of a wait for a page",
    "test/viewer/viewer_page_test.py": "deadline of a wait for a page",
}


def code(path: Path) -> str:
    """Without comments, whose words are free."""
    text = path.read_text(encoding="utf-8")
    return re.sub(r"(?m)(?<![:\"'])#.*$" if path.suffix == ".py" else r"//.*", "", text)


def test_no_test_names_a_clock_but_for_a_reason():
    files = [f for f in (ROOT / "test").rglob("*") if f.suffix in (".py", ".c", ".cpp", ".h", ".hpp") and f != Path(__file__).resolve()]
    found = {f.relative_to(ROOT).as_posix(): sorted(set(CLOCK.findall(code(f)))) for f in files if CLOCK.search(code(f))}
    new = {name: words for name, words in found.items() if name not in REASONS}
    assert not new, "count what grows (test/growth.py) or wait for an event; if it is only a deadline, add the file and the reason to REASONS"
    assert set(REASONS) == set(found), "files without clocks need no reason"


@pytest.mark.parametrize(
    "line",
    ["start = time.perf_counter()", "from time import process_time", "time.monotonic_ns()", "time.sleep(0.1)", "std::chrono::steady_clock::now()", "std::clock()",
     "clock_gettime(CLOCK_MONOTONIC, &t)", "std::this_thread::sleep_for(1ms)", "page.wait_for_timeout(50)", "timeit.timeit(run)", "condition.wait_for(lock, 1s)"],
)  # fmt: skip
def test_clocks_are_seen(line):
    assert CLOCK.search(line)


@pytest.mark.parametrize(
    "line", ["subprocess.run(command, timeout=60)", "said in time", "time = np.linspace(0, 1, 11)", "page.wait_for_function(READY)", "differential clock times"]
)
def test_other_words_are_free(line):
    assert not CLOCK.search(line)
