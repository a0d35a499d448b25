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
