"""What tests of generated code share."""

import pytest
from generated_code import EXAMPLES

import ksl


@pytest.fixture(scope="module")
def ur5():
    return ksl.load(EXAMPLES / "ur5.urdf")
