"""A sample that was dropped, held or is off is a doubt, whether velocities are differentiated or in the file."""

import numpy as np
import pytest

from ksl.motions.reading import read_motion

T = np.arange(0, 4, 0.01)
AT = 150


def doubts(leg, tmp_path, rates, hip, hip_v=None, **options):
    """rates: how many of velocities and accelerations are in the file."""
    zero = 0 * T[: len(hip)]
    v = np.cos(2 * T) if hip_v is None else hip_v
    columns = {"time": T[: len(hip)], "hip": hip, "slide": zero} | dict(zip(("hip.v", "hip.a"), (v, -2 * np.sin(2 * T)))) | {"slide.v": zero, "slide.a": zero}
    columns = {name: x[: len(hip)] for name, x in columns.items() if rates >= (0 if "." not in name else 1 if name.endswith("v") else 2)}
    np.savetxt(tmp_path / "m.csv", np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="", fmt="%.9g")
    return read_motion(leg, tmp_path / "m.csv", **options).doubts


def swing():
    return 0.5 * np.sin(2 * T)


@pytest.mark.parametrize("rates", [0, 1, 2], ids=["positions", "velocities", "accelerations"])
@pytest.mark.parametrize("value", [0.0, 0.5 * np.sin(2 * T[AT - 1]), 1.0], ids=["dropped", "held", "off"])
def test_a_sample_that_is_off(leg, tmp_path, rates, value):
    hip = swing()
    off, hip[AT] = value - hip[AT], value
    (said,) = doubts(leg, tmp_path, rates, hip)
    assert said.startswith(f"the sample of hip at 1.5 s is {off:.4g} off those around it")
    assert ("while hip.v goes on as before: efforts there are those of another position" in said) == (rates > 0)


@pytest.mark.parametrize("rates", [0, 1, 2], ids=["positions", "velocities", "accelerations"])
@pytest.mark.parametrize("at", [0, 1, 2, 3, -4, -3, -2, -1])
def test_the_first_and_the_last_samples(leg, tmp_path, rates, at):
    """Recorders begin with zeros, before the first message came.  Nothing was said of the first and the last four samples."""
    hip = 0.7 + swing()
    off, hip[at] = -hip[at], 0.0
    (said,) = doubts(leg, tmp_path, rates, hip)
    assert said.startswith(f"the sample of hip at {T[at]:.6g} s is {off:.4g} off those around it")


@pytest.mark.parametrize("rates", [0, 1])
@pytest.mark.parametrize("many", [2, 3])
def test_several_samples_before_the_first_message(leg, tmp_path, rates, many):
    hip = 0.7 + swing()
    hip[:many] = 0.0
    (said,) = doubts(leg, tmp_path, rates, hip)
    assert said.startswith("hip jumps by 0.7") and f"at {T[many] - 0.005:.6g} s" in said
    hip = 0.7 + swing()
    hip[-many:] = 0.0
    (said,) = doubts(leg, tmp_path, rates, hip)
    assert said.startswith("hip jumps by -1.1") and f"at {T[-many] - 0.005:.6g} s" in said


@pytest.mark.parametrize("rates", [0, 1])
@pytest.mark.parametrize("start", [0, 1, 2, 3])
def test_motions_that_begin_within_the_first_samples(leg, tmp_path, rates, start):
    """With a jump of the acceleration, as trapezoidal profiles have it, or of the speed, or held for a sample: the samples are where the machine was."""
    since = np.maximum(T - T[start], 0.0)
    for x, v in ((np.where(since < 1, since**2 / 2, since - 0.5), np.minimum(since, 1.0)), (0.5 * since, 0.5 * (T >= T[start]))):
        for hip, hip_v in ((x, v), (x[::-1], -v[::-1])):
            assert not any("off those around" in said or said.startswith("hip jumps") for said in doubts(leg, tmp_path, rates, 0.4 + hip, hip_v))


@pytest.mark.parametrize("rates", [0, 1])
def test_positions_of_which_some_are_missing(leg, tmp_path, rates):
    """Velocities come from another source, which lost none."""
    hip = np.delete(swing(), slice(AT, AT + 3))
    (said,) = doubts(leg, tmp_path, rates, hip)
    assert said.startswith("hip jumps by -0.02977") and "at 1.495 s" in said


def test_a_fault_of_both_is_named_once(leg, tmp_path):
    hip, v = swing(), np.cos(2 * T)
    hip[AT] = v[AT] = 0.0
    (said,) = doubts(leg, tmp_path, 1, hip, v)
    assert said.startswith("the sample of hip.v at 1.5 s")


def test_what_is_no_fault(leg, tmp_path):
    """Turns of a joint whose angle is counted anew, positions that were rounded, and noise."""
    rng = np.random.default_rng(1)
    turned = np.where(T > 2, swing() + 2 * np.pi, swing())
    for hip in (swing(), turned, np.round(swing(), 3), swing() + rng.normal(0, 1e-3, len(T))):
        assert not any(word in said for said in doubts(leg, tmp_path, 1, hip) for word in ("off those around", "jumps"))
