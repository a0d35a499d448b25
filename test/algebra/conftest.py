import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from library import Library


@pytest.fixture(scope="session")
def ksl():
    return Library()
