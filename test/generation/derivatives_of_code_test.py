"""Derivatives of generated functions, against the engine's."""

import numpy as np
import pytest
from generated_code import EXAMPLES, FLAGS, FOLLOWED, call, check_bits, compiled, on_struts, run, spatial_four_bar

import ksl


def test_derivatives_are_those_of_the_engine(tmp_path):
    ur5 = ksl.load(EXAMPLES / "ur5.urdf")
    asked = ["vjp.inverse_dynamics", "jvp.inverse_dynamics", "vjp.reactions:elbow+wrist_1", "vjp.forward_dynamics", "vjp.jacobian:tool0"]
    ksl.generate(ur5, asked, tmp_path, name="p", arguments=["payload:tool0", "gravity"])
    run("gcc", *FLAGS, "p.c", "p_test.c", "-o", "test", "-lm", cwd=tmp_path)
    run(tmp_path / "test", cwd=tmp_path)
    code, rng = compiled(tmp_path, "p"), np.random.default_rng(1)
    (q, v, x, w), gravity, none = rng.normal(size=(4, 6)), np.array(ur5.gravity), np.zeros(10)

    def close(found, expected):
        assert np.abs(found - expected.ravel()).max() <= 1e-12 * np.abs(expected).max()

    *by, by_gravity, by_payload = call(code.p_inverse_dynamics_vjp, (q, v, x, gravity, none, w), [6, 6, 6, 3, 10])
    for found, expected in zip(by, ur5.inverse_dynamics_gradient(q, v, x, w)):
        close(found, expected)
    close(by_gravity, np.array([w @ ur5.with_gravity(e).gravity_torque(q) for e in np.eye(3)]))
    close(by_payload, np.einsum("v,vp->p", w, ur5.inverse_dynamics_regressor(q, v, x)[:, ur5.link_names.index("tool0")]))
    dq, dv, da = rng.normal(size=(3, 6))
    (along,) = call(code.p_inverse_dynamics_jvp, (q, v, x, gravity, none, dq, dv, da, np.zeros(3), none), [6])
    close(along, sum(D @ d for D, d in zip(ur5.inverse_dynamics_derivatives(q, v, x), (dq, dv, da))))
    for found, D in zip(call(code.p_forward_dynamics_vjp, (q, v, x, gravity, none, w), [6, 6, 6, 3, 10]), ur5.forward_dynamics_derivatives(q, v, x)):
        close(found, w @ D)
    weights = rng.normal(size=(2, 6))
    for found, D in zip(
        call(code.p_reactions_vjp, (q, v, x, gravity, none, weights), [6, 6, 6, 3, 10]), ur5.reactions_derivatives(q, v, x, joints=["elbow", "wrist_1"])
    ):
        close(found, np.einsum("jc,jcv->v", weights, D))


def test_derivatives_along_quaternions_followers_and_force_elements(tmp_path):
    floating, gripper = ksl.load(EXAMPLES / "ur5.urdf", floating_base=True), ksl.load_string(FOLLOWED)
    for k, m in enumerate((floating, gripper, on_struts().build(physics="all"))):
        folder, rng = tmp_path / str(k), np.random.default_rng(k)
        ksl.generate(m, ["vjp.inverse_dynamics"], folder, name="p")
        q, (v, a, w) = m.random(k), rng.normal(size=(3, m.nv))
        for found, D in zip(call(compiled(folder, "p").p_inverse_dynamics_vjp, (q, v, a, w), [m.nv] * 3), m.inverse_dynamics_derivatives(q, v, a)):
            assert np.abs(found - w @ D).max() <= 1e-12 * np.abs(D).max()


def test_derivatives_along_a_closed_mechanism(tmp_path):
    """By the drives: those of dynamics, and of reactions, which are derivatives of recorded reactions."""
    m, rng, joints = spatial_four_bar(), np.random.default_rng(1), ["elbow", "ball"]
    named = ":" + "+".join(joints)
    ksl.generate(
        m,
        ["vjp.inverse_dynamics", "vjp.forward_dynamics", "jvp.inverse_dynamics", f"vjp.reactions{named}", f"reactions_derivatives{named}"],
        tmp_path,
        name="p",
    )
    code, f, nv = compiled(tmp_path, "p"), len(m.drives), m.nv
    q, free = m.close(m.neutral()).q, m.independent(m.close(m.neutral()).q)
    v = m.consistent_velocity(q, rng.normal(size=nv), given=free)
    a = m.consistent_acceleration(q, v, rng.normal(size=nv), given=free)
    w, weights, rates = rng.normal(size=nv), rng.normal(size=(len(joints), 6)), rng.normal(size=(3, f))
    by = m.inverse_dynamics_derivatives(q, v, a)
    expected = [w @ D for D in by]
    found = call(code.p_inverse_dynamics_vjp, (q, v, a, w), [f] * 3)
    expected += [sum(D @ x for D, x in zip(by, rates))]
    found += call(code.p_inverse_dynamics_jvp, (q, v, a, *rates), [nv])
    tau = m.inverse_dynamics(q, v, a)
    expected += [w @ D for D in m.forward_dynamics_derivatives(q, v, tau)]
    found += call(code.p_forward_dynamics_vjp, (q, v, tau, w), [f, f, nv])
    by = m.reactions_derivatives(q, v, a, joints=joints)
    expected += [np.einsum("jc,jcf->f", weights, D) for D in by] + [D.ravel() for D in by]
    found += call(code.p_reactions_vjp, (q, v, a, weights), [f] * 3) + call(code.p_reactions_derivatives, (q, v, a), [by[0].size] * 3)
    for x, y in zip(found, expected, strict=True):
        assert np.abs(x - y).max() <= 1e-11 * np.abs(y).max()


def test_derivatives_along_a_mechanism_on_springs(tmp_path):
    m = ksl.load(EXAMPLES / "andrews.urdf", physics="all")
    assert check_bits(m, ["inverse_dynamics_derivatives", "forward_dynamics_derivatives"], tmp_path, bound=1e-11) > 100
    with pytest.raises(ValueError, match="put together by the library"):
        m.compile(["inverse_dynamics_derivatives"])


def test_derivatives_of_exact_friction_are_refused(tmp_path):
    text = (EXAMPLES / "panda.urdf").read_text().replace('<parent link="panda_link0"/>', '<parent link="panda_link0"/><dynamics friction="2"/>')
    m = ksl.load_string(text, physics="exact friction")
    with pytest.raises(ValueError, match="exact dry friction"):
        ksl.generate(m, ["vjp.inverse_dynamics"], tmp_path / "out")
    ksl.generate(m, ["vjp.mass_matrix"], tmp_path, name="p")
