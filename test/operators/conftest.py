import pytest
from operator_cases import ROBOTS, robot_named


@pytest.fixture(scope="module", params=ROBOTS)
def robot(request):
    return robot_named(request.param)
