"""Inputs of generated functions besides those of rows."""

import numpy as np
import pytest
from generated_code import EXAMPLES, FLAGS, call, compiled, run

import ksl


@pytest.mark.parametrize(("scalar", "dtype", "bound"), [("double", np.float64, 1e-13), ("float", np.float32, 1e-4)])
def test_payloads_and_parameters_are_inputs(tmp_path, scalar, dtype, bound):
    """The payload is on a link that is welded to another, and parameters are those of a link within."""
    m = ksl.load(EXAMPLES / "panda.urdf").with_frame("gripper", "panda_flange", ksl.Pose.from_rpy((0.01, -0.02, 0.1), (0.3, -0.2, 0.9)))
    asked = ["inverse_dynamics", "forward_dynamics", "mass_matrix", "reactions:panda_joint3+gripper_joint", "inverse_dynamics_regressor", "frame_pose:gripper"]
    ksl.generate(m, asked, tmp_path, name="p", scalar=scalar, arguments=["gravity", "payload:gripper", "parameters:panda_link4"])
    run("gcc", *FLAGS, "p.c", "p_test.c", "-o", "test", "-lm", cwd=tmp_path)
    run(tmp_path / "test", cwd=tmp_path)
    header = (tmp_path / "p.h").read_text().replace("float", "double")
    assert "void p_mass_matrix(const double *q, const double *payload, const double *parameters, double *M);" in header
    assert "const double *a, const double *gravity, double *Y);" in header and "void p_frame_pose_gripper(const double *q, double *pose);" in header
    code, rng, own = compiled(tmp_path, "p"), np.random.default_rng(1), np.array(m.link("panda_link4").parameters)
    for k in range(5):
        q, v, x, gravity = (rng.normal(size=n).astype(dtype) for n in (m.nq, m.nv, m.nv, 3))
        payload = (np.array([2.0, 0.1, -0.2, 0.4, 0.3, 0.02, 0.25, -0.05, 0.04, 0.2]) * (k > 0)).astype(dtype)
        parameters = (own * (1 + 0.1 * k)).astype(dtype)
        other = m.with_gravity(gravity).with_parameters({"gripper": payload.astype(float), "panda_link4": parameters.astype(float)})
        for row, given, wanted in (
            ("inverse_dynamics", (v, x, gravity), other.inverse_dynamics(q, v, x)),
            ("forward_dynamics", (v, x, gravity), other.forward_dynamics(q, v, x)),
            ("mass_matrix", (), other.mass_matrix(q)),
            ("reactions", (v, x, gravity), other.reactions(q, v, x, joints=["panda_joint3", "gripper_joint"])),
        ):
            (found,) = call(getattr(code, f"p_{row}"), (q, *given, payload, parameters), [wanted.size], dtype)
            assert np.abs(found - wanted.ravel()).max() <= bound * (10 if row == "forward_dynamics" else 1) * np.abs(wanted).max(), row


def test_without_payload_results_have_the_bits_of_the_robot_alone(tmp_path):
    ur5 = ksl.load(EXAMPLES / "ur5.urdf")
    ksl.generate(ur5, ["inverse_dynamics", "forward_dynamics"], tmp_path, name="p", arguments=["payload:tool0+forearm_link"])
    code, (q, v, x) = compiled(tmp_path, "p"), np.random.default_rng(3).normal(size=(3, 6))
    for row in ("inverse_dynamics", "forward_dynamics"):
        (found,) = call(getattr(code, f"p_{row}"), (q, v, x, np.zeros(20)), [6])
        assert np.array_equal(found, getattr(ur5, row)(q, v, x))
