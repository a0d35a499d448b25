"""Many cases in one test, where each takes less time than a test of its own, which takes several milliseconds."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable

import pytest


def each(name: str, cases: Iterable, made: Callable = lambda case: case) -> Callable[[Callable], Callable]:
    """In place of `pytest.mark.parametrize`: one test calls the function with every case, and names the one that fails.

    name: of the argument.  made: what the function is given for a case.  Cases share the fixtures of the test.  Like tests, they skip what they
    don't apply to; the test is skipped where all do."""
    cases = list(cases)

    def decorate(test: Callable) -> Callable:
        @functools.wraps(test)
        def every_case(**fixtures: object) -> None:
            skipped = []
            for case in cases:
                try:
                    test(**fixtures, **{name: made(case)})
                except pytest.skip.Exception as e:
                    skipped.append(e)
                except (Exception, pytest.fail.Exception) as e:
                    raise AssertionError(f"{name} {case}: {e}") from e
            if skipped and len(skipped) == len(cases):
                raise skipped[0]

        given = inspect.signature(test)
        every_case.__signature__ = given.replace(parameters=[p for p in given.parameters.values() if p.name != name])
        del every_case.__wrapped__
        return every_case

    return decorate
