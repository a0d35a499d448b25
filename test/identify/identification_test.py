"""Base parameters, and identification from recorded motions: statistics of noise, and bodies that can exist whatever the data."""

import itertools
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from linkages import FOURBAR, FREE_COUPLER, smaller

import ksl
from ksl import base_parameters, consistency
from ksl.consistency import from_log_cholesky, from_pseudo_inertia, is_consistent
from ksl.identification import identify
from ksl.identify import fit
from ksl.identify.possible_bodies import LeastSquares, matrices, minimum, numbers_of

sys.path.insert(0, str(Path(__file__).parents[1] / "laws"))
from random_tree import load_text, random_states, random_tree


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


def test_base_parameters_of_a_mechanism_that_closes_near_its_file_alone():
    """Random positions of a link that floats in the file are out of reach of links of some centimetres."""
    free, plain = (ksl.load_string(smaller(text, 0.1), drives=["A"]) for text in (FREE_COUPLER, FOURBAR))
    assert len(base_parameters.structural(free)) == len(base_parameters.structural(plain)) > 3


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
        ({"links": 3}, "links=3; expected a list of names"),
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


# ------------------------------------------------------------------------------------- how far it got, and what it says of that


def other_bodies(rng, names):
    """Links of 0.3 to 30 kg, some 10 cm large and off their origins."""
    theta = 0.5 * rng.normal(size=(len(names), 10))
    theta[:, 0] += 0.5 * np.log(3.0)
    theta[:, 1:4] += np.log(0.05)
    theta[:, 4:] *= np.repeat([0.05, 0.1], 3)
    return from_log_cholesky(theta)


def a_panda(seed):
    panda = ksl.load("examples/robots/panda.urdf")
    return panda, *periodic_motion(np.random.default_rng(seed), panda, samples=300)


def a_tree(seed, bodies=3, floating=False):
    rng = np.random.default_rng(seed)
    tree = load_text(random_tree(rng, bodies), floating_base=floating)
    return tree, *random_states(tree, rng, 200)


ROBOTS = {
    "panda 0": lambda: a_panda(0),
    "panda 1": lambda: a_panda(1),
    **{f"tree {seed} of three": lambda seed=seed: a_tree(seed) for seed in range(1, 9)},
    "tree of eight": lambda: a_tree(11, 8),
    "floating tree": lambda: a_tree(12, 5, floating=True),
}


@pytest.mark.parametrize("name", ROBOTS)
def test_exact_efforts_of_other_links_come_back(name):
    """Bodies that can exist, and give zero residuals, are found from a prior that is wrong."""
    robot, q, v, a = ROBOTS[name]()
    links = [link.name for link in robot.links if link.name in base_parameters.moving_links(robot) and link.mass > 0]
    truth = other_bodies(np.random.default_rng(1), links)
    tau = robot.with_parameters(dict(zip(links, truth))).inverse_dynamics(q, v, a)
    f = identify(robot, q, v, a, tau)
    assert f.converged and f.certificate.reason == "converged" and is_consistent(f.parameters).all()
    assert np.abs(f.residuals).max() < 1e-9 * np.abs(tau).max()
    assert np.allclose(f.base_values, f.base.values(truth), rtol=1e-6, atol=1e-7 * np.abs(f.base_values).max())
    assert f.certificate.excess < 1 and f.certificate.steps < 50 and "converged" in repr(f)


def clipped(S):
    """The nearest positive semidefinite matrix in the Frobenius norm (Higham, 1988)."""
    values, axes = np.linalg.eigh(S)
    return axes * np.maximum(values, 0) @ axes.T


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3, 1e8])
def test_the_minimum_is_the_projection_where_that_is_the_problem(scale):
    """With B a multiple of one, the sum of squares is a multiple of the distance from a point."""
    rng = np.random.default_rng(3)
    S0 = np.array([2 * np.eye(4) + 0.3 * np.diag(rng.normal(size=4)) for _ in range(3)])
    wanted = rng.normal(size=30) * 3
    problem = LeastSquares(scale * np.eye(30), scale * (1 + scale**-2) * wanted)  # least at `wanted`
    found = minimum(problem, S0, 0.7, lambda x: np.linalg.eigvalsh(S0 + 0.7 * matrices(x.reshape(-1, 10))).min() > 0)
    S = S0 + 0.7 * matrices(found.x.reshape(-1, 10))
    expected = np.array([clipped(one) for one in S0 + 0.7 * matrices(wanted.reshape(-1, 10))])
    assert found.converged and not found.free and np.abs(S - expected).max() < 1e-3 / max(scale, 1) ** 0.5


def test_the_bound_holds(m):
    """No possible bodies near what was found have a sum of squares below its bound; the bound of a wrong result is large."""
    rng = np.random.default_rng(4)
    S0 = np.broadcast_to(np.eye(4), (2, 4, 4))
    problem = LeastSquares(rng.normal(size=(25, 20)), 30 * rng.normal(size=25))
    found = minimum(problem, S0, 1.0, lambda x: np.linalg.eigvalsh(S0 + matrices(x.reshape(-1, 10))).min() > 0)
    assert found.converged and found.gradient < 1e-6 and found.steps > 0
    for size in np.logspace(-6, 1, 400):
        x = found.x + size * rng.normal(size=20)
        x = numbers_of(np.array([clipped(one) for one in S0 + matrices(x.reshape(-1, 10))]) - S0).ravel()
        assert problem.value(x) >= found.sum_of_squares - found.above


def of_the_panda(m, share=0.02, **changes):
    rng = np.random.default_rng(0)
    q, v, a, tau, sigma = recording(m, rng, share)
    names = [link.name for link in m.links[1:] if link.mass > 0]
    truth = truth_of(m, names)
    given = {
        "nothing": {},
        "half": {"prior": dict(zip(names, 0.5 * truth)), "prior_deviation": 0.01},
        "rough": {"prior": dict(zip(names, rough_bodies(rng, truth)))},
        "another": {"prior": dict(zip(names, other_bodies(rng, names))), "prior_deviation": 0.1},
        "thousandth": {"prior": dict(zip(names, 1e-3 * truth))},
        "noise": {"noise": sigma},
        "noise / 5": {"noise": sigma / 5},
        "5 noise": {"noise": 5 * sigma},
    }[changes.pop("given", "nothing")]
    return identify(m, q, v, a, changes.pop("tau", lambda tau, v: tau)(tau, v), **given, **changes), truth


@pytest.mark.parametrize(
    ("changes", "sentences"),
    [
        ({}, []),
        ({"given": "rough"}, []),
        ({"given": "noise"}, []),
        ({"share": 0.3}, []),
        ({"given": "half"}, ["prior and motion disagree: by", r"it pulls panda_link.* by [\d.]{2,} of the standard deviation"]),
        ({"given": "another"}, ["prior and motion disagree"]),
        ({"given": "thousandth"}, ["prior and motion disagree"]),
        ({"tau": lambda tau, v: -tau}, ["no possible bodies explain the efforts"]),
        ({"tau": lambda tau, v: -tau, "given": "noise"}, ["no possible bodies explain the efforts", "times the noise that was given"]),
        ({"given": "noise / 5"}, ["are [45].* times the noise that was given"]),
        ({"given": "5 noise"}, ["are only 0.[12].* times the noise that was given"]),
        ({"tau": lambda tau, v: tau + [0, 0, 0, 0, 30, 0, 0]}, ["no possible bodies|residuals are not noise"]),
        ({"links": ["panda_link6", "panda_link7"], "tau": lambda tau, v: 1.5 * tau}, ["residuals are not noise: those of panda_joint"]),
        ({"tau": lambda tau, v: 0 * tau, "noise": 1e-12}, ["not converged: rounding", "no possible bodies"]),
    ],
)
def test_what_is_doubtful_is_said(m, changes, sentences):
    """In `doubts` and in what is printed; and nothing where all is well."""
    f, _ = of_the_panda(m, **changes)
    assert len(f.doubts) >= len(sentences) and bool(f.doubts) == bool(sentences), f
    for sentence in sentences:
        assert any(re.search(sentence, doubt) for doubt in f.doubts), f
    assert all(doubt in repr(f) for doubt in f.doubts) and f.converged == (not any("not converged" in doubt for doubt in f.doubts))


SCALES = [1e-3, 1e-2, 0.1, 0.25, 0.5, 2.0, 4.0, 10.0, 1e3]


def scaled(m, factor, joint=None, share=0.02, **options):
    q, v, a, tau, _ = recording(m, np.random.default_rng(0), share)
    factors = np.full(m.nv, factor) if joint is None else np.where(np.arange(m.nv) == joint, factor, 1.0)
    return identify(m, q, v, a, factors * tau, **options)


@pytest.mark.parametrize("prior_deviation", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("factor", SCALES)
def test_efforts_of_another_size_are_said_with_their_factor(m, factor, prior_deviation):
    """All residuals are as they should be: bodies of 54 g for 8.4 kg explain a hundredth of the efforts."""
    f = scaled(m, factor, prior_deviation=prior_deviation)
    assert f.certificate.scale.common == pytest.approx(factor, rel=0.01)
    assert any(re.search(rf"efforts are {factor:.1g}\S* times|efforts are \S+ times", doubt) and "one factor for all joints" in doubt for doubt in f.doubts), f


FACTORS = [x for x in SCALES if not 0.3 < x < 3] + [-1.0]


@pytest.mark.parametrize(("joint", "factor"), [(joint, FACTORS[(3 * joint + k) % len(FACTORS)]) for joint in range(7) for k in range(3)])
def test_efforts_of_one_joint_of_another_size_are_doubted(m, factor, joint):
    f = scaled(m, factor, joint)
    known = f.certificate.scale.factors[joint]
    assert f.doubts and (np.isnan(known) or known == pytest.approx(factor, rel=0.02))
    assert np.isnan(known) or abs(f.certificate.scale.agreement[joint]) < 0.9 or f"panda_joint{joint + 1} {known:.3g}" in f.doubts[0]


@pytest.mark.parametrize("links", [None, ["panda_link6", "panda_link7"]])
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_efforts_that_are_noise_are_said(m, size, links):
    rng = np.random.default_rng(1)
    q, v, a, tau, sigma = recording(m, rng)
    f = identify(m, q, v, a, size * rng.normal(size=tau.shape), links=links)
    assert f.doubts[0].startswith("all efforts look like noise")
    f = identify(m, q, v, a, np.where(np.arange(7) == 3, size * rng.normal(size=tau.shape), tau))
    assert f.doubts[0].startswith("efforts of panda_joint4 look like noise")
    f = identify(m, q, v, a, tau * (np.arange(7) != 6), noise=sigma)
    assert f.doubts[0].startswith("efforts of panda_joint7 are zero in every sample")


def test_a_factor_that_is_the_gear_ratio_is_named():
    """Of one joint, whose prior may be wrong by as much: a motor's efforts, and the drive's of two joints."""
    b = ksl.Builder("arm").add_link("frame")
    for k, gear in enumerate((50, 101)):
        b.add_link(f"l{k}", mass=2.0, center_of_mass=(0.3, 0, 0), inertia=0.05 * np.eye(3))
        b.add_joint(
            f"j{k}", "revolute", f"l{k - 1}" if k else "frame", f"l{k}", axis=(0, 1, 0), pose=ksl.Pose(np.eye(4) + 0.4 * k * np.eye(4, k=3)), gear_ratio=gear
        )
    arm = b.build()
    q, v, a = periodic_motion(np.random.default_rng(0), arm, samples=100)
    (doubt, *_) = identify(arm, q, v, a, arm.inverse_dynamics(q, v, a) / (50, 101)).doubts
    assert "j0 0.02 (1/50 is its gear ratio)" in doubt and "j1 0.0099 (1/101 is its gear ratio)" in doubt
    assert not identify(arm, q, v, a, arm.inverse_dynamics(q, v, a)).doubts


@pytest.mark.parametrize(("seed", "deviation"), list(zip(range(40), itertools.cycle([1e-4, 1e-3, 1.0]))))
def test_exact_efforts_leave_nothing_whatever_the_prior_says(seed, deviation):
    """What least squares leaves nothing of, no prior may turn into noise; or `converged` says that it did."""
    tree, q, v, a = a_tree(seed)
    links = [link.name for link in tree.links if link.name in base_parameters.moving_links(tree) and link.mass > 0]
    tau = tree.with_parameters(dict(zip(links, other_bodies(np.random.default_rng(seed), links)))).inverse_dynamics(q, v, a)
    f = identify(tree, q, v, a, tau, prior_deviation=deviation)
    left = np.abs(f.residuals).max() / np.abs(tau).max()
    assert is_consistent(f.parameters).all() and (left < 1e-6 or not f.converged), (left, f)
    assert f.converged and left < 1e-6


def test_noise_that_does_not_settle_is_said(m, monkeypatch):
    monkeypatch.setattr(fit, "ROUNDS", 1)
    q, v, a, tau, _ = recording(m, np.random.default_rng(1))
    f = identify(m, q[:12], v[:12], a[:12], tau[:12])
    assert not f.converged and f.certificate.reason == "noise" and f.certificate.noise_change > 0.01 and "not converged" in repr(f)


def test_a_wrong_prior_does_not_become_noise(m):
    """What the motion alone says stays in the fields, and the noise is that of the efforts."""
    f, truth = of_the_panda(m, given="half")
    expected, _ = of_the_panda(m)
    assert np.allclose(f.noise, expected.noise, rtol=1e-6)
    by_motion = f.base_values - f.certificate.pull * f.base_deviations
    assert np.abs(by_motion - f.base.values(truth)).max() < 1.0 and f.certificate.prior_distance > 10
    assert np.abs(f.certificate.prior_differences).max() > 10 and np.abs(f.certificate.pull).max() > 50


def test_false_alarms_are_rare(m):
    alarms = [f.doubts for seed in range(3) for q, v, a, tau, _ in [recording(m, np.random.default_rng(seed))] if (f := identify(m, q, v, a, tau)).doubts]
    assert not alarms


def chain_of_size(s, mu):
    """Three links, with lengths of s and masses of μ; gravity is the earth's."""
    bodies = {
        "a": (2.0, (0.1, 0, 0.05), (0.02, 0.03, 0.04)),
        "b": (1.0, (0.15, 0.02, 0), (0.002, 0.01, 0.0099)),
        "c": (0.5, (0, 0.02, 0.1), (8e-4, 1e-3, 4e-4)),
    }
    joints = [("w", "a", (0, 0, 0.2), "0 1 0"), ("a", "b", (0.3, 0, 0), "0 0 1"), ("b", "c", (0.25, 0, 0), "0 1 0")]
    text = '<robot name="r"><link name="w"/>'
    for name, (mass, c, i) in bodies.items():
        moments = " ".join(f'{n}="{mu * s * s * x!r}"' for n, x in zip(("ixx", "iyy", "izz"), i))
        at = " ".join(repr(s * x) for x in c)
        text += f'<link name="{name}"><inertial><origin xyz="{at}"/><mass value="{mu * mass!r}"/><inertia {moments} ixy="0" ixz="0" iyz="0"/></inertial></link>'
    for parent, child, at, axis in joints:
        origin = " ".join(repr(s * x) for x in at)
        text += (
            f'<joint name="to_{child}" type="continuous"><parent link="{parent}"/><child link="{child}"/><origin xyz="{origin}"/><axis xyz="{axis}"/></joint>'
        )
    return ksl.load_string(text + "</robot>")


@pytest.mark.parametrize(("s", "mu"), [(1e-4, 1e-9), (1e3, 1e6)])
def test_the_size_of_a_robot_does_not_enter(s, mu):
    """Of similar robots at similar speeds, v² ~ g s, all efforts are as μ s, and so are parameters, each by its own unit.

    A robot of 0.1 mm had a prior of bodies of 1 cm, which held nothing."""

    def found(s, mu):
        m, units = chain_of_size(s, mu), mu * np.array([1, *[s] * 3, *[s**2] * 6])
        rng = np.random.default_rng(3)
        q, v, a = periodic_motion(rng, m, samples=200)
        v, a = v / np.sqrt(s), a / s
        tau = m.inverse_dynamics(q, v, a)
        tau += 0.05 * np.sqrt(np.mean(tau**2, axis=0)) * rng.normal(size=tau.shape)
        prior = {
            link.name: np.array(link.parameters) * ([1.3, *[1.1] * 3, *[1.5] * 6] if link.name != "c" else [1.3, *[1.1] * 3, *[0] * 6]) for link in m.links[1:]
        }
        return identify(m, q, v, a, tau, prior=prior).parameters / units

    one, other = found(1.0, 1.0), found(s, mu)
    assert np.abs(other - one).max() < 1e-4 * np.abs(one).max()
