"""Annotations: of the package, strictly, and as a user's program sees them."""

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


def mypy(*arguments):
    """With numpy's annotations read once for all runs."""
    done = subprocess.run([sys.executable, "-m", "mypy", *arguments], cwd=ROOT, capture_output=True, text=True)
    return done.stdout + done.stderr


def test_the_package_is_annotated_throughout():
    assert mypy().startswith("Success"), mypy()
    assert mypy("--package", "ksl").startswith("Success"), "the installed package, stubs of extensions too"


def test_a_users_program(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    assert mypy(program).startswith("Success"), mypy(program)
    program.write_text(PROGRAM + 'm.reactions(q, q, q, on="both")\nm.nq = "seven"\n')
    assert [line.rpartition(" ")[2] for line in mypy(program).splitlines() if " error: " in line] == ["[arg-type]", "[assignment]"]
