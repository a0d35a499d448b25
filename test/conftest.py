"""What all Python tests share: one fixed profile for random examples, so that a run today is the run of tomorrow.

`pytest --long` runs the tests marked `many_cases` alone, with ten times as many random cases; `make test-long` does."""

from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

import random_cases

settings.register_profile("fixed", derandomize=True, deadline=None, max_examples=60, database=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("fixed")

ROOT = Path(__file__).resolve().parent.parent


def pytest_addoption(parser):
    parser.addoption("--long", action="store_true", help="run the tests marked many_cases alone, with 100,000 random cases instead of 10,000")


def pytest_configure(config):
    """Before any test module is imported: modules take the number into constants of their own."""
    if config.getoption("--long"):
        random_cases.MANY = random_cases.LONG


def pytest_collection_modifyitems(config, items):
    if config.getoption("--long"):
        left_out = [item for item in items if not item.get_closest_marker("many_cases")]
        items[:] = [item for item in items if item.get_closest_marker("many_cases")]
        config.hook.pytest_deselected(items=left_out)


@pytest.fixture(scope="session")
def examples() -> Path:
    """The folder of robots and motions that ship with KSL."""
    return ROOT / "examples"


@pytest.fixture
def robot(tmp_path):
    """Writes URDF text to a file and loads it: robot(text, **options of ksl.load)."""
    import ksl

    def load(text: str, **options):
        path = tmp_path / "robot.urdf"
        path.write_text(text)
        return ksl.load(path, **options)

    return load
