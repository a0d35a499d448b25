"""Sweeps without processes of their own: starting one takes more than a second.  test/sweeps/sweep_test.py tests the processes."""

from collections.abc import Iterator

import pytest


def compute(plan, partitions, workers) -> Iterator:
    """In place of ksl.sweeps.local.compute: the same partitions, one after the other, in this process."""
    from ksl.sweeps.evaluate import Evaluator

    evaluator = Evaluator(plan)
    for partition in partitions:
        yield evaluator.partition(partition)


def sweep_here() -> None:
    """From here on, in this process."""
    from ksl.sweeps import local

    local.compute = compute


@pytest.fixture
def sweeps_here(monkeypatch) -> None:
    """In one test; test/conftest.py lends it to all."""
    from ksl.sweeps import local

    monkeypatch.setattr(local, "compute", compute)
