"""Units of columns: every name of one, in brackets, in capitals and as a rate, and what is refused."""

import numpy as np
import pytest

from ksl.base.errors import MotionError
from ksl.motions.columns.units import Unit, factor, unit_of
from ksl.motions.reading import read_motion

NAMES_OF_UNITS = {
    ("time", 1.0): "s sec secs second seconds", ("time", 60.0): "min", ("time", 3600.0): "h", ("time", 1e-3): "ms msec", ("time", 1e-6): "us µs μs", ("time", 1e-9): "ns nsec",
    ("angle", 1.0): "rad rads radian radians", ("angle", 1e-3): "mrad", ("angle", 2 * np.pi): "rev turn turns", ("angle", np.pi / 180): "deg degs degree degrees °",
    ("length", 1.0): "m", ("length", 1e-2): "cm", ("length", 1e-3): "mm", ("length", 1e-6): "um µm μm", ("length", 0.0254): "in inch",
}  # fmt: skip
ENDS = ("", "/s /sec s^-1 ·s^-1 *s^-1".split(), "/s² /s^2 /s2 /(s^2) s^-2 /s/s /sec^2 /s**2".split())


@pytest.mark.parametrize(("quantity", "factor"), NAMES_OF_UNITS, ids=str)
def test_units_of_columns(quantity, factor):
    """With rates of all but times, in brackets and capitals."""
    for name in NAMES_OF_UNITS[quantity, factor].split():
        for per_time in (0, 1, 2):
            for end in ENDS[per_time] or ("",):
                expected = None if quantity == "time" and per_time else Unit(quantity, per_time, pytest.approx(factor, rel=1e-15))
                for text in (
                    name + end,
                    f"[{name}{end}]",
                    f"( {name} {end})",
                    f"<{name}{end}>",
                    (name + end).upper() if (name + end).isascii() else name + end,
                ):
                    assert unit_of(text) == expected, text


@pytest.mark.parametrize("text", ["rpm", "1/min", "U/min", "r/min"])
def test_turns_a_minute(text):
    assert unit_of(text) == Unit("angle", 1, pytest.approx(np.pi / 30)) and [unit_of(x) for x in ("-", "1", "none", "", "[]")] == [Unit("plain", 0, 1.0)] * 5


def test_units_that_are_none():
    assert [unit_of(x) for x in ("s/s", "furlong", "deg/m", "kg")] == [None] * 4


@pytest.mark.parametrize(("rule", "where"), [({"to": "hip"}, "m.csv"), ({"to": "hip", "unit": "mm"}, "map")])
def test_a_unit_that_does_not_fit_is_where_it_was_given(leg, written, rule, where):
    """In the file, or in the map that names the column."""
    path = written("time,x,slide\ns,mm,mm\n0,0,0\n1,0,0\n" if where == "m.csv" else "time,x,slide\n0,0,0\n1,0,0\n", "m.csv")
    with pytest.raises(MotionError, match="column 'x' is in 'mm', but expected rad") as e:
        read_motion(leg, path, map={"x": rule})
    assert str(e.value).startswith(str(path) if where == "m.csv" else "map")


def test_units_of_rates():
    assert (
        factor("f", "c", "deg", "angle", 1, True) == pytest.approx(np.pi / 180) == factor("f", "c", "deg/s", "angle", 1)
        and factor("f", "c", "-", "angle", 1) == 1
    )
    for wrong in (("deg", "angle", 1), ("deg/s^2", "angle", 1, True), ("m", "angle", 0), ("m", "angle", 1, True)):
        with pytest.raises(MotionError, match="but expected"):
            factor("f", "c", *wrong)
    with pytest.raises(MotionError, match="no unit that KSL knows; did you mean 'deg'"):
        factor("f", "c", "degg", "angle", 0)
