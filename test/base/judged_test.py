"""Numbers of files by their quantities."""

import pytest

from ksl.base.judged import LENGTH_UNIT, MASS, RATIO, OutOfBounds, judged


@pytest.mark.parametrize(("x", "bounds"), [(1e-9, LENGTH_UNIT), (1e9, LENGTH_UNIT), (0.0, MASS), (-2.5, RATIO), (1e12, MASS)])
def test_numbers_within_bounds_stay(x, bounds):
    assert judged(x, "it", bounds) == x


@pytest.mark.parametrize(
    ("x", "bounds", "said"),
    [
        (0.0, LENGTH_UNIT, "it is 0 m; expected 1e-09 to 1e+09 m; correct it in the file"),
        (float("nan"), MASS, "it is nan kg; expected 1e-15 to 1e+12 kg, or 0; correct it in the file"),
        (float("-inf"), RATIO, "it is -inf; expected a magnitude of 1e-09 to 1e+09; correct it in the file"),
        (-1e-10, RATIO, "it is -1e-10; expected a magnitude of 1e-09 to 1e+09; correct it in the file"),
        (-1.0, MASS, "it is -1 kg; expected 1e-15 to 1e+12 kg, or 0; correct it in the file"),
        (1.1e12, MASS, "it is 1.1e+12 kg; expected 1e-15 to 1e+12 kg, or 0; correct it in the file"),
    ],
)
def test_numbers_beyond_are_refused(x, bounds, said):
    with pytest.raises(OutOfBounds) as e:
        judged(x, "it", bounds)
    assert str(e.value) == said
