"""Robot files of the PyPI package example-robot-data, found without importing it or what it depends on."""

import importlib.metadata
from pathlib import Path

FOLDER = "share/example-robot-data/robots/"


def all_robots() -> dict[str, Path]:
    """{path below the package's folder of robots: file} of every URDF file."""
    files = importlib.metadata.distribution("example-robot-data").files or []
    found = {str(f).partition(FOLDER)[2]: Path(str(f.locate())) for f in files if f.suffix == ".urdf" and FOLDER in str(f)}
    return dict(sorted(found.items()))
