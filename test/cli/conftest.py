"""A robot with its motion, large and small."""

import math
from pathlib import Path

import pytest

from loads_runs import SLIDE


@pytest.fixture(scope="module")
def ur5(examples) -> tuple[Path, Path]:
    return examples / "robots" / "ur5.urdf", examples / "motions" / "ur5_pick.csv"


@pytest.fixture
def two(tmp_path) -> tuple[Path, Path]:
    """A small robot with one joint, named slide, and a motion."""
    folder = tmp_path / "given"
    folder.mkdir()
    (folder / "two.urdf").write_text(SLIDE)
    (folder / "two.csv").write_text("time,slide\n" + "".join(f"{k / 10},{math.sin(k / 10)}\n" for k in range(20)))
    return folder / "two.urdf", folder / "two.csv"
