"""One row for each algorithm.  From it scripts/generate.py makes the kernels, the C++ and C calls, the Python method, the
reference page, and the test that compares them with each other.

A new algorithm is a header in include/ksl/engine/algorithms/GROUP/ and a row in the file of its group; CONTRIBUTING.md says what the
header must define.  A new group is a file here, a folder there, and a name in GROUPS.
"""

from importlib import import_module

from algorithms.row import INPUTS, Algorithm, Result

__all__ = ["ALGORITHMS", "GROUP_OF", "INPUTS", "Algorithm", "Result"]

GROUPS = ("inverse", "forward", "mass", "kinematics", "operational_space", "energy", "whole_body", "derivatives", "parameters", "manifold", "loops")
"""In the order of the reference."""

GROUP_OF: dict[str, str] = {row.name: group for group in GROUPS for row in import_module(f"algorithms.{group}").ROWS}
ALGORITHMS: tuple[Algorithm, ...] = tuple(row for group in GROUPS for row in import_module(f"algorithms.{group}").ROWS)
