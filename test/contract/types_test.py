"""Annotations as a user's program sees them.  `make lint` reads those of the package, strictly."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("mypy")

ROOT = Path(__file__).resolve().parents[2]

PROGRAM = """
import numpy as np
import ksl
from ksl import ufuncs

m = ksl.load("robot.urdf", mimic="independent")
q = np.zeros(m.nq)
tau: np.ndarray = m.inverse_dynamics(q, q, [0.0] * m.nv, {"tool": [1.0, 0, 0, 0, 0, 0]}, threads=1)
held: np.ndarray = m.reactions(q, q, q, on="parent", at=(0, 0, 0.1), part="constraint", joints=m.joint_names)
kinetic, potential = m.energy(q, q, out=(np.empty(()), np.empty(())))
poses: np.ndarray = m.frame_poses(q, ["tool"], threads=2)
moved: np.ndarray = ufuncs.product_CoAdc(ufuncs.poses(m.frame_pose(q, "tool")), held)
"""


def test_a_users_program(tmp_path):
    """Two lines that are wrong are found, and nothing else."""
    program = tmp_path / "program.py"
    program.write_text(PROGRAM + 'm.reactions(q, q, q, on="both")\nm.nq = "seven"\n')
    done = subprocess.run([sys.executable, "-m", "mypy", program], cwd=ROOT, capture_output=True, text=True)
    assert [line.rpartition(" ")[2] for line in done.stdout.splitlines() if " error: " in line] == ["[arg-type]", "[assignment]"], done.stdout + done.stderr
