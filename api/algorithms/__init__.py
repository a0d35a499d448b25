"""One row for each algorithm.  From it scripts/generate.py makes the kernels, the C++ and C calls, the Python method, the
reference page, and the test that compares them with each other.

A new algorithm is a header in include/ksl/engine/ and a row in the file of its group; CONTRIBUTING.md says what the header must
define.
"""

from algorithms import energy, forward, inverse, kinematics, manifold, mass
from algorithms.row import INPUTS, Algorithm, Result

__all__ = ["ALGORITHMS", "INPUTS", "Algorithm", "Result"]

ALGORITHMS: tuple[Algorithm, ...] = inverse.ROWS + forward.ROWS + mass.ROWS + kinematics.ROWS + energy.ROWS + manifold.ROWS
