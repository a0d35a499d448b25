#!/usr/bin/env python3
"""The sources of the engine that aren't kernels, relative to src/: what a program needs of which only some kernels are compiled, and no reader of files.

scripts/engine_sources.py    prints them, for make"""

from pathlib import Path

SRC = Path(__file__).resolve().parents[1] / "src"
KERNELS = {"engine/kernels/finite.cpp", "engine/kernels/array_kernels.cpp", "engine/kernels/inverse_kinematics_kernels.cpp"}
OF_READERS = {"engine/run/frozen_joints.cpp", "batch/inverse_kinematics.cpp"}
"""What needs the making of robots from others, or kernels of its own."""
BESIDE = (
    "description/parts/joint_numbers.cpp",
    *(f"description/structure/{name}.cpp" for name in ("check", "force_elements", "loops", "mimic")),
    *(f"text/{name}.cpp" for name in ("characters", "unused", "words")),
)


def engine_sources() -> list[str]:
    found = {path.relative_to(SRC).as_posix() for pattern in ("engine/*/*.cpp", "batch/*.cpp") for path in SRC.glob(pattern)}
    return [*sorted(found - KERNELS - OF_READERS), *BESIDE]


if __name__ == "__main__":
    print(*engine_sources())
