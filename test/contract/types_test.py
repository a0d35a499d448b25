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
from ksl.operators.calls import Calls

m = ksl.load("robot.urdf", mimic="independent")
q = np.zeros(m.nq)
tau: np.ndarray = m.inverse_dynamics(q, q, [0.0] * m.nv, {"tool": [1.0, 0, 0, 0, 0, 0]}, threads=1)
held: np.ndarray = m.reactions(q, q, q, on="parent", at=(0, 0, 0.1), part="constraint", joints=m.joint_names)
kinetic, potential = m.energy(q, q, out=(np.empty(()), np.empty(())))
poses: np.ndarray = m.frame_poses(q, ["tool"], threads=2)
moved: np.ndarray = ufuncs.product_CoAdc(ufuncs.poses(m.frame_pose(q, "tool")), held)
run = ksl.compute_loads(m, "motion.csv")
columns: list[str] = run.summary.column_names + m.wrench_table([0.0], [q]).column_names
class Own: ...
def of_constants(d: Calls[Own], x: Own) -> Own:
    return d.inverse_dynamics(q, x, 0.0, m.parameters, external={"tool": [1.0, 0, 0, 0, 0, 0]})
kind = ksl.Builder("b").add_joint("j", "revolute", "a", "b", ksl.Pose.from_rpy((0, 0, 1))).build().joint("j").kind
"""
WRONG = """
m.reactions(q, q, q, on="both")
m.nq = "seven"
m.forward_kinematics(q)
run.summary.columns_names
ksl.Builder("b").add_joint("j", "revolut", "a", "b")
kind == "revolut"
"""


def test_a_users_program(tmp_path):
    """Lines that are wrong are found, and nothing else."""
    program = tmp_path / "program.py"
    program.write_text(PROGRAM + WRONG)
    done = subprocess.run([sys.executable, "-m", "mypy", program], cwd=ROOT, capture_output=True, text=True)
    assert [line.rpartition(" ")[2] for line in done.stdout.splitlines() if " error: " in line] == [
        "[arg-type]",
        "[assignment]",
        "[attr-defined]",
        "[attr-defined]",
        "[arg-type]",
        "[comparison-overlap]",
    ], done.stdout + done.stderr
