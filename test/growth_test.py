"""Counts of work: what grows with the square is seen, in lines, in calls and in comparisons; the same run gives the same count."""

import gc
import math
import sys

import pytest

from growth import Name, assert_linear, work


def names(n: int) -> list[str]:
    return [Name(f"joint{k}") for k in range(n)]


def lines(n: int) -> None:
    found = 0
    for i in range(n):
        for _ in range(i):
            found += 1


WITH_THE_SQUARE = {
    "lines": lines,
    "a comprehension in one line": lambda n: [[i for _ in range(i)] for i in range(n)],
    "a generator in one line": lambda n: [sum(1 for _ in range(i)) for i in range(n)],
    "a list that is searched": lambda n: [str(name) in these for these in [names(n)] for name in these],
    "places in a list": lambda n: [these.index(str(name)) for these in [names(n)] for name in these],
}


@pytest.mark.parametrize("what", WITH_THE_SQUARE)
def test_the_square_is_seen(what):
    with pytest.raises(AssertionError, match="(0.9|1.0)[0-9] of it grows with the square"):
        assert_linear(lambda n: work(lambda: WITH_THE_SQUARE[what](n)), 30)


def test_the_square_is_seen_beside_much_that_is_linear_and_sorting_is_none():
    with pytest.raises(AssertionError, match="0.[23][0-9] of it"):
        assert_linear(lambda n: 1000 * n + n * n, 100)
    with pytest.raises(AssertionError, match="[1-9].[0-9]+ of it"):
        assert_linear(lambda n: 2**n, 5)
    assert_linear(lambda n: 1000 + round(n * math.log2(n)), 16)
    assert_linear(lambda n: min(n, 50), 16)


def test_what_is_linear_passes_and_is_counted_alike():
    run = lambda n: [name in index for index in [dict.fromkeys(names(n))] for name in names(n)]
    assert_linear(lambda n: work(lambda: run(n)), 60)
    assert work(lambda: run(100)) == work(lambda: run(100)) > 200


def test_other_tracers_come_back():
    tracer = lambda *_: None
    before = sys.gettrace(), sys.getprofile()
    sys.settrace(tracer), sys.setprofile(tracer)
    try:
        with pytest.raises(ZeroDivisionError):
            work(lambda: 1 // 0)
        assert sys.gettrace() is tracer is sys.getprofile()
    finally:
        sys.settrace(before[0]), sys.setprofile(before[1])


def test_what_is_done_where_garbage_is_collected_is_not_counted():
    def makes_garbage() -> None:
        kept.extend([[]] for _ in range(20_000))  # new lists, which the collector counts

    def noticed(phase: str, info: dict[str, int]) -> None:
        seen.append(phase)

    kept: list[list[list[int]]] = []
    seen: list[str] = []
    undisturbed = work(makes_garbage)
    kept.clear()
    gc.callbacks.append(noticed)
    try:
        assert work(makes_garbage) == undisturbed and not seen and gc.isenabled()
    finally:
        gc.callbacks.remove(noticed)
