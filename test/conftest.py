"""What all Python tests share: one fixed profile for random examples, so that a run today is the run of tomorrow."""

from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile("fixed", derandomize=True, deadline=None, max_examples=60, database=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("fixed")

ROOT = Path(__file__).resolve().parent.parent


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
