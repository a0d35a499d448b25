"""Every URDF file of example-robot-data in every library that is installed, fixed and floating: no number differs without a reason."""

import sys
import warnings
from pathlib import Path

import pytest

import ksl
from ksl.comparison.libraries import LIBRARIES, is_installed

pytestmark = pytest.mark.long
sys.path.append(str(Path(__file__).parents[1] / "reference"))


@pytest.mark.parametrize("floating", [False, True], ids=["fixed", "floating"])
def test_no_difference_is_without_a_reason(floating):
    from robots import all_robots

    compared = 0
    for name, path in all_robots().items():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ksl.DescriptionWarning)
            try:
                found = ksl.compare(path, [x for x, library in LIBRARIES.items() if is_installed(library)], floating_base=floating, states=2)
            except ksl.DescriptionError:
                continue
        for library in found.libraries:
            assert library.unexplained == [], (name, library)
            compared += not library.failed
    assert compared > 50
