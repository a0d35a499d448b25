"""Robot files of the tests, checked without the packages of the machine."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

pytest.importorskip("lxml")


@pytest.fixture(autouse=True)
def no_packages(monkeypatch):
    for name in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "GAZEBO_MODEL_PATH", "GZ_SIM_RESOURCE_PATH"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def check(tmp_path):
    """Writes a robot to a file and checks it: check(text, **options of ksl.check)."""
    import ksl

    def write_and_check(text, name="robot.urdf", **options):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return ksl.check(path, **options)

    return write_and_check
