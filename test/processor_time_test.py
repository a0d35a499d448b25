"""Bounds of processor time: what is too slow is noticed, and a slow machine is not blamed."""

import processor_time
from processor_time import takes_less_than, timed, usual_seconds


def busy(times: int) -> int:
    return sum(len(bytes(1000)) for _ in range(times))


def test_what_takes_longer_is_noticed():
    took, total = timed(lambda: busy(100_000))
    assert total == 100_000_000
    assert takes_less_than(10 * took, lambda: busy(100_000))
    assert not takes_less_than(took / 10, lambda: busy(100_000))


def test_a_machine_of_a_tenth_of_the_speed_is_not_blamed(monkeypatch):
    took = usual_seconds(lambda: busy(100_000))
    monkeypatch.setattr(processor_time, "USUAL", processor_time.USUAL / 10)
    assert takes_less_than(took / 3, lambda: busy(100_000))
