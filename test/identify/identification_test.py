"""Base parameters, and identification from recorded motions: statistics of noise, and bodies that can exist whatever the data."""

import numpy as np
import pytest

import ksl
from ksl import base_parameters, consistency
from ksl.consistency import from_pseudo_inertia, is_consistent
from ksl.identification import identify


@pytest.fixture(scope="module")
def m(examples) -> ksl.Model:
    return ksl.load(examples / "robots/panda.urdf")


def periodic_motion(rng, m, seconds=10.0, samples=400):
    """Sums of five harmonics for each joint: (q, v, a), each (samples, nv)."""
    t = np.linspace(0, seconds, samples)[:, None]
    q, v, a = np.zeros((3, samples, m.nv))
    for k in range(1, 6):
        w = 2 * np.pi * k / seconds
        A, B = 0.6 * rng.normal(size=(2, m.nv))
        q += A * np.sin(w * t) + B * np.cos(w * t)
        v += w * (A * np.cos(w * t) - B * np.sin(w * t))
        a -= w * w * (A * np.sin(w * t) + B * np.cos(w * t))
    return q, v, a


def rough_bodies(rng, truth):
    """Balls of about the right mass at about the right place."""
    mass, c = truth[:, 0] * rng.uniform(0.7, 1.4, len(truth)), truth[:, 1:4] / truth[:, :1] + 0.03 * rng.normal(size=(len(truth), 3))
    J = np.zeros((len(truth), 4, 4))
    J[:, :3, :3] = mass[:, None, None] * (0.01 * np.eye(3) + c[:, :, None] * c[:, None, :])
    J[:, :3, 3] = J[:, 3, :3] = mass[:, None] * c
    J[:, 3, 3] = mass
    return from_pseudo_inertia(J)


def truth_of(m, names):
    return np.array([link.parameters for name in names for link in m.links if link.name == name])


def recording(m, rng, share=0.02):
    q, v, a = periodic_motion(rng, m)
    tau = m.inverse_dynamics(q, v, a)
    sigma = share * np.sqrt(np.mean(tau**2, axis=0))
    return q, v, a, tau + sigma * rng.normal(size=tau.shape), sigma


@pytest.fixture(scope="module")
def found(m):
    """Identifications of one motion with noise of several seeds, from rough bodies as the prior."""
    out = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        q, v, a, tau, sigma = recording(m, rng)
        names = [link.name for link in m.links[1:] if link.mass > 0]
        prior = dict(zip(names, rough_bodies(rng, truth_of(m, names))))
        out.append((identify(m, q, v, a, tau, prior=prior), sigma))
    return out


def test_base_parameters_are_found_to_the_noise(m, found):
    """By the covariance that is returned: none beyond five standard deviations, and the mean square near one."""
    all_z = []
    for f, sigma in found:
        assert len(f.base) == 43  # of a panda, as published
        z = (f.base_values - f.base.values(truth_of(m, f.links))) / f.base_deviations
        assert np.abs(z).max() < 5
        assert np.allclose(f.noise, sigma, rtol=0.2)
        all_z.append(z)
    assert 0.6 < np.sqrt(np.mean(np.square(all_z))) < 1.4


def test_bodies_are_consistent_and_give_the_efforts(m, found):
    for f, sigma in found:
        assert is_consistent(f.parameters).all()
        assert np.sqrt(np.mean(f.residuals**2, axis=0)) == pytest.approx(sigma, rel=0.2)
        if f.model is not None:
            q, v, a = periodic_motion(np.random.default_rng(99), m)
            ours, true = f.model.inverse_dynamics(q, v, a), m.inverse_dynamics(q, v, a)
            assert np.sqrt(np.mean((ours - true) ** 2, axis=0)) == pytest.approx(np.zeros(m.nv), abs=0.5 * sigma.max())


@pytest.mark.parametrize(("samples", "size"), [(1, 0.0), (2, 1.0), (5, 1e4), (12, 0.0), (12, 1e4), (40, 1.0)])
def test_no_data_give_an_impossible_body(m, samples, size):
    rng = np.random.default_rng(samples)
    q, v, a, tau, _ = recording(m, rng)
    part = slice(0, samples)
    bad = tau[part] + size * rng.normal(size=(samples, m.nv)) * np.abs(tau).max()
    f = identify(m, q[part], v[part], a[part], bad)
    assert is_consistent(f.parameters).all() and np.isfinite(f.base_deviations).all()


def test_confident_noise_and_wrong_signs(m):
    """Efforts with the wrong sign, said to be exact, would be those of negative masses."""
    q, v, a, tau, _ = recording(m, np.random.default_rng(1))
    f = identify(m, q[::5], v[::5], a[::5], -tau[::5], noise=1e-3)
    assert not f.free and is_consistent(f.parameters).all()


def test_a_rigid_pose_identifies_little(m):
    q = np.zeros((10, m.nq))
    zero = np.zeros((10, m.nv))
    f = identify(m, q, zero, zero, m.gravity_torque(q))
    assert len(f.base) < m.nv and is_consistent(f.parameters).all()


def test_external_wrenches_and_links_that_are_known(m):
    rng = np.random.default_rng(5)
    q, v, a = periodic_motion(rng, m)
    push = {m.link_names[-1]: rng.normal(size=(len(q), 6))}
    tau = m.inverse_dynamics(q, v, a, push) + 1e-3 * rng.normal(size=(len(q), m.nv))
    f = identify(m, q, v, a, tau, links=["panda_link7", "panda_link6"], external=push, noise=1e-3)
    z = (f.base_values - f.base.values(truth_of(m, f.links))) / f.base_deviations
    assert np.abs(z).max() < 5 and len(f.links) == 2


def test_base_parameters_of_the_structure(m):
    b = base_parameters.structural(m)
    assert len(b) == len(b.names) == 43 and b.links == tuple(m.link_names[1:])
    rng = np.random.default_rng(2)
    q, v, a = rng.normal(size=(3, 20, m.nv))
    Y = m.inverse_dynamics_regressor(q, v, a, links=b.links)
    tau = b.regressor(Y) @ b.values(m.parameters[1:])
    assert np.abs(tau - m.inverse_dynamics(q, v, a)).max() < 1e-9
    assert "panda_link1.m" in b.without_effect and b.names[0] == "panda_link1.Izz + panda_link2.Iyy"


def test_a_pendulum_by_hand(tmp_path):
    """A pendulum about y: its moment about the axis, and both first moments across it."""
    (tmp_path / "p.urdf").write_text(
        '<robot name="p"><link name="a"/><link name="b"><inertial><origin xyz="0.1 0 0.2"/><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
        'iyz="0"/></inertial></link><joint name="j" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/></joint></robot>'
    )
    b = base_parameters.structural(ksl.load(tmp_path / "p.urdf"))
    assert b.names == ("b.mx", "b.mz", "b.Iyy")
    assert np.allclose(b.values([[2, 0.2, 0, 0.4, 1, 0, 1.1, 0, 0, 1]]), [0.2, 0.4, 1.1])


def test_a_floating_base_has_all_of_its_own(examples):
    m = ksl.load(examples / "robots/panda.urdf", floating_base=True)
    b = base_parameters.structural(m)
    root = [name for name in b.names if name.startswith("panda_link0")]
    assert len(root) == 10 and len(b) == 10 + 7 * 7  # a joint that turns adds seven, since its parent moves in any way


def test_bad_input_is_named(m):
    q, v, a = np.zeros((3, 4, m.nv))
    with pytest.raises(ValueError, match=r"tau: expected shape \(4, 7\)"):
        identify(m, q, v, a, np.zeros((3, 7)))
    wrong = np.zeros((4, 7))
    wrong[2, 3] = np.nan
    with pytest.raises(ValueError, match="tau: sample 2, number 3 is nan"):
        identify(m, q, v, a, wrong)
    with pytest.raises(ValueError, match="no link named 'hand'"):
        identify(m, q, v, a, np.zeros((4, 7)), links=["hand"])
    with pytest.raises(ValueError, match="link panda_flange has mass 0"):
        identify(m, q, v, a, np.zeros((4, 7)), links=["panda_flange"])
    with pytest.raises(ValueError, match="prior_deviation=0"):
        identify(m, q, v, a, np.zeros((4, 7)), prior_deviation=0)
    with pytest.raises(ValueError, match="noise: expected 7 positive"):
        identify(m, q, v, a, np.zeros((4, 7)), noise=-1)


LINK = "panda_link3"


@pytest.mark.parametrize(
    ("keywords", "sentence"),
    [
        ({"links": [LINK, LINK]}, "links: 'panda_link3' is named more than once"),
        ({"links": 3}, "links=3; expected names of links"),
        ({"prior": {LINK: np.ones(9)}}, "prior: link panda_link3 has 9 numbers"),
        ({"prior": {LINK: np.full(10, np.nan)}}, "prior: link panda_link3"),
        ({"prior": [LINK]}, "prior is list; expected a mapping"),
        ({"external": [1]}, "external is list; expected a mapping"),
        ({"external": {LINK: np.zeros(5)}}, r"external\['panda_link3'\] has shape \(5,\)"),
        ({"external": {LINK: np.zeros((3, 6))}}, r"expected \(6,\), or \(4, 6\)"),
        ({"noise": [1, 2]}, "noise: expected 7 positive"),
        ({"prior_deviation": "a"}, "prior_deviation is 'a'; expected a number"),
        ({"tolerance": -1.0}, "tolerance=-1.0; expected a number between 0 and 1"),
        ({"q": "fast"}, "q is 'fast'; expected numbers"),
        ({"model": "panda"}, "model is str; expected a ksl.Model"),
    ],
)
def test_each_argument_says_what_is_wrong(m, keywords, sentence):
    q, v, a = np.zeros((3, 4, m.nv))
    with pytest.raises(ValueError, match=sentence):
        identify(**({"model": m, "q": q, "v": v, "a": a, "tau": np.zeros((4, 7))} | keywords))


def test_parameters_of_other_shapes_are_refused(m):
    for call, sentence in (
        (lambda: consistency.from_pseudo_inertia(np.eye(3)), r"J: expected a pseudo-inertia of shape \(…, 4, 4\)"),
        (lambda: consistency.consistency_metric(np.zeros(10)), "a pseudo-inertia is singular"),
        (lambda: consistency.is_consistent("a"), "parameters is 'a'; expected numbers"),
        (lambda: base_parameters.of_regressor(np.full((3, 1, 10), np.nan), ["a"]), "regressor: expected finite numbers"),
    ):
        with pytest.raises(ValueError, match=sentence):
            call()
    assert len(base_parameters.structural(m, LINK)) == len(base_parameters.structural(m, [LINK]))
    assert len(base_parameters.structural(m, [])) == 0


def test_a_link_that_no_effort_depends_on_warns_of_nothing(m):
    q, v, a = np.random.default_rng(0).normal(size=(3, 30, m.nv))
    found = identify(m, q, v, a, m.inverse_dynamics(q, v, a), links=["panda_link0"])
    assert len(found.base) == 0 and np.allclose(found.parameters, m.link("panda_link0").parameters)


def test_physics_of_the_model_need_not_be_subtracted():
    b = ksl.Builder("drive").add_link("frame").add_link("arm", mass=2.0, center_of_mass=(0.3, 0, 0), inertia=0.05 * np.eye(3))
    b.add_joint("hinge", "revolute", "frame", "arm", axis=(0, 1, 0), damping=0.2, friction=1.5, rotor_inertia=2e-5, gear_ratio=100)
    motor = b.build(physics="all")
    q, v, a = np.random.default_rng(0).normal(size=(3, 50, 1))
    assert np.abs(identify(motor, q, v, a, motor.inverse_dynamics(q, v, a)).residuals).max() < 1e-9
