"""Limits of the numbers of joints with several coordinates: where they are kept, and that inverse kinematics keeps them."""

import pickle
import warnings

import numpy as np
import pytest

import ksl

LIMITS = {
    "cyl": [(-1.0, 1.0), (0.0, 0.3)],
    "uni": [(-0.5, 0.5), None],
    "pla": [(-0.2, 0.2), (-0.1, None), (-1.0, 1.0)],
    "tra": [(-0.2, 0.2), (-0.1, 0.1), (-0.3, 0.3)],
    "rev": (-1.0, 1.0),
}


@pytest.fixture(scope="module")
def chain() -> ksl.Model:
    b = ksl.Builder("chain")
    for name in "abcdef":
        b.add_link(name, mass=1, center_of_mass=(0.1, 0, 0.2), inertia=np.eye(3) * 0.1)
    pose = np.eye(4)
    pose[:3, 3] = 0.1, 0.0, 0.4
    kinds = {"cyl": "cylindrical", "uni": "universal", "pla": "planar", "tra": "translation", "rev": "revolute"}
    axes = {"cyl": {"axis": (0, 0, 1)}, "uni": {"axis": (1, 0, 0), "axis2": (0, 1, 0)}, "pla": {"axis": (0, 0, 1)}, "tra": {}, "rev": {"axis": (0, 1, 0)}}
    for (name, kind), parent, child in zip(kinds.items(), "abcde", "bcdef", strict=True):
        b.add_joint(name, kind, parent, child, pose=pose, limits=LIMITS[name], **axes[name])
    return b.build()


def bounds(m: ksl.Model) -> np.ndarray:
    """(2, nq), infinite where there are none."""
    given = [pair for j in m.joints if j.nq for pair in j.limits]
    return np.array([[-np.inf if a is None else a, np.inf if b is None else b] for a, b in given]).T


def test_limits_are_kept_by_what_keeps_models(chain, tmp_path):
    for name, given in LIMITS.items():
        pairs = [given] if isinstance(given, tuple) else given
        assert chain.joint(name).limits == tuple(pair or (None, None) for pair in pairs)
    chain.to_urdf(tmp_path / "chain.urdf")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ksl.DescriptionWarning)  # types beyond URDF
        again = ksl.load(tmp_path / "chain.urdf")
    assert again.unused == ()
    for other in (again, pickle.loads(pickle.dumps(chain)), chain.with_payload("f", 1.0), chain.merged(chain, "f", prefix="p_")):
        assert [other.joint(name).limits for name in LIMITS] == [chain.joint(name).limits for name in LIMITS]


def test_random_positions_and_inverse_kinematics_keep_limits(chain):
    lower, upper = bounds(chain)
    inside = lambda q: ((q >= lower) & (q <= upper)).all()
    rng = np.random.default_rng(0)
    q = chain.random(rng, 200)
    assert inside(q) and (q.max(axis=0) - q.min(axis=0) > 0.1).all()
    target = chain.frame_pose(q, "f")
    found = chain.inverse_kinematics("f", target)
    assert inside(found.q) and found.converged.mean() >= 0.98
    assert np.abs(chain.frame_pose(found.q, "f") - target)[found.converged].max() < 1e-5
    far = target.copy()
    far[:, :3, 3] += 5.0
    missed = chain.inverse_kinematics("f", far)
    assert inside(missed.q) and (missed.reason[~missed.converged] == "limits").mean() > 0.9
    free = chain.inverse_kinematics("f", far, limits=False)
    assert free.converged.all() and not inside(free.q)


def test_a_start_beyond_limits_is_no_result(chain, examples):
    arm = ksl.load(examples / "robots/panda.urdf")
    q = np.zeros(7)  # beyond the upper limit of the fourth joint
    for m, tip, start in ((arm, "panda_flange", q), (chain, "f", chain.neutral() + 2.0)):
        lower, upper = bounds(m)
        found = m.inverse_kinematics(tip, m.frame_pose(start, tip), q0=start)
        assert ((found.q >= lower) & (found.q <= upper)).all()
        assert np.array_equal(m.inverse_kinematics(tip, m.frame_pose(start, tip), q0=start, limits=False).q, start)


def test_sdf_gives_limits_to_both_axes(tmp_path):
    axis = "<axis{0}><xyz>{1}</xyz><limit><lower>{2}</lower><upper>{3}</upper></limit></axis{0}>"
    text = '<sdf version="1.10"><model name="m"><link name="a"/><link name="b"/><joint name="weld" type="fixed"><parent>world</parent><child>a</child></joint>'
    text += f'<joint name="j" type="universal"><parent>a</parent><child>b</child>{axis.format("", "1 0 0", -1, 0.5)}{axis.format(2, "0 1 0", -0.25, 2)}</joint></model></sdf>'
    (tmp_path / "m.sdf").write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ksl.DescriptionWarning)  # masses that the format gives
        m = ksl.load(tmp_path / "m.sdf")
    assert m.joint("j").limits == ((-1, 0.5), (-0.25, 2)) and m.unused == ()


@pytest.mark.parametrize(
    ("kind", "limits", "sentence"),
    [
        ("cylindrical", [(0, 1), (1, -1)], "limits of number 2 of its position: lower limit 1 is above upper limit -1"),
        ("cylindrical", [(0, 1)] * 3, "a cylindrical joint has no lower limit of number 3"),
        ("cylindrical", (0, 1), "several numbers in q, each of which needs"),
        ("cylindrical", [(0, 1, 2)], r"expected \(lower, upper\)"),
        ("cylindrical", [(np.nan, 1)], "is not a number"),
        ("spherical", [(0, 1)], "a spherical joint has no lower limit"),
        ("revolute", [(0, 1), (0, 1)], "a revolute joint has no lower limit of number 2"),
    ],
)
def test_limits_that_cannot_be(kind, limits, sentence):
    b = ksl.Builder("b").add_link("a").add_link("b", mass=1)
    with pytest.raises(ValueError, match=sentence):
        b.add_joint("j", kind, "a", "b", axis=None if kind == "spherical" else (0, 0, 1), limits=limits)


def test_what_is_beyond_limits_is_reported(chain):
    from ksl.load_cases.load_case import LoadCase
    from ksl.motions.motion import Motion

    time = np.linspace(0, 1, 12)
    q = np.tile(chain.neutral(), (12, 1))
    q[:, 1], q[5, 5] = 0.1, -0.4
    motion = Motion(time, q, np.zeros((12, chain.nv)), np.zeros((12, chain.nv)))
    exceeded = ksl.compute_loads(chain, cases=[LoadCase(chain, motion)]).verdict.exceeded
    assert [use.exceeded for use in exceeded] == ["pla: y -0.4 m is beyond the lower limit -0.1 m"]


def with_follower(follower: tuple[float | None, float | None], leader: tuple[float | None, float | None], multiplier: float = 2.0) -> ksl.Builder:
    """y = multiplier x + 10."""
    b = ksl.Builder("pair").add_link("base").add_link("a", mass=1, inertia=np.eye(3)).add_link("b", mass=1, inertia=np.eye(3))
    b.add_joint("x", "revolute", "base", "a", axis=(0, 1, 0), limits=leader)
    return b.add_joint("y", "prismatic", "base", "b", axis=(0, 1, 0), mimic=("x", multiplier, 10.0), limits=follower)


def test_limits_of_a_follower_that_its_leader_cannot_keep_are_said_and_not_used():
    with pytest.warns(ksl.DescriptionWarning, match="joint y: it follows x, .* those of y are not used"):
        m = with_follower((0, 0.5), (-1, 1)).build()
    assert (m.lower, m.upper) == (-1, 1)
    q = m.random(0, 1000)
    assert (np.abs(q) <= 1).all() and np.ptp(q) > 1.9
    assert pickle.loads(pickle.dumps(m)).warnings == m.warnings


@pytest.mark.parametrize(
    ("follower", "leader", "multiplier", "least", "most"),
    [
        ((9, 11), (-1, 1), 2, -0.5, 0.5),
        ((9, 11), (-1, 1), -2, -0.5, 0.5),
        ((18, 20), (None, None), 2, 4, 5),  # beyond half a turn, the usual range of a joint without limits
        ((None, 10), (0, 7), 2, 0, 0),
        ((18, None), (None, 5), 2, 4, 5),
    ],
)
def test_positions_keep_the_limits_of_followers(follower, leader, multiplier, least, most):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        m = with_follower(follower, leader, multiplier).build()
    q = m.random(0, 1000)
    assert (m.lower, m.upper) == (least, most) and (q >= least).all() and (q <= most).all() and np.ptp(q) >= 0.9 * (most - least)
