"""Reactions where nothing resists in some directions: levers by hand, the limit of small stiffnesses, and what keeps the zeros."""

import pickle
import warnings

import numpy as np
import pytest

import ksl
from ksl.load_cases.provenance import compliances_of
from ksl.model.surgery import with_compliances
from linkages import FOURBAR, at

L, C, MASS = 0.4, 0.14, 12.0


def shaft(second="cylindrical"):
    """On bearings A, at 0, and B, at L, with its weight at C: a weightless frame at B is its end."""
    b = ksl.Builder("rotor").add_link("ground").add_link("shaft", MASS, (C, 0, 0), np.diag([0.05, 0.09, 0.09]))
    b.add_joint("A", "continuous", "ground", "shaft", axis=(1, 0, 0))
    return b.add_loop("B", second, "ground", "shaft", at([L, 0, 0]), at([L, 0, 0]), axis=(1, 0, 0)).build(drives=["A"])


def both(m, **more):
    return m.reactions([0.0], [0.0], [0.0], joints=["A", "B"], **more)


def test_bearings_that_tilt_freely_share_by_levers():
    weight = 9.81 * MASS
    f = both(shaft().with_stiffness({"A": {"axial": 8e7, "radial": 1e8, "tilting": 0}, "B": {"radial": 3e7, "tilting": 0}}))
    np.testing.assert_allclose(f[:, 2], [weight * (L - C) / L, weight * C / L], rtol=1e-12)
    np.testing.assert_allclose(f[:, [0, 1, 3, 4, 5]], 0, atol=1e-11)
    assert shaft().with_stiffness({"A": {"radial": 1e8, "tilting": 0}, "B": {"radial": 3e7, "tilting": 0}}).reactions_unique([0.0], ["A", "B"]).all()


def test_one_that_does_not_resist_beside_one_that_does():
    """The tilting stiffness t of B alone, and both radial ones: the shaft's angle balances the moments about B."""
    weight, ka, kb, t = 9.81 * MASS, 1e8, 3e7, 4e4
    f = both(shaft().with_stiffness({"A": {"radial": ka, "tilting": 0}, "B": {"radial": kb, "tilting": t}}))
    K = np.array([[ka + kb, kb * L], [kb * L, kb * L * L + t]])  # of the displacement at A and the slope
    z, slope = np.linalg.solve(K, [-weight, -weight * C])
    np.testing.assert_allclose(f[:, 2], [-ka * z, -kb * (z + slope * L)], rtol=1e-11)
    np.testing.assert_allclose(f[:, 4], [0, t * slope], rtol=1e-11, atol=1e-11)  # slope along z: −rotation about y


@pytest.mark.parametrize("single", [False, True])
def test_zeros_are_the_limit_of_small_stiffnesses_in_any_pose(single):
    m = ksl.load_string(FOURBAR, drives=["A"])
    rng = np.random.default_rng(1)
    pin = lambda tilting: {"axial": 2e5, "radial": 4e5, "tilting": tilting}
    given = lambda k: {"A": pin(300.0), "B": pin(k), "C": pin(200.0), "D": {**pin(250.0), "axial": k}}
    q = np.array([m.close(np.array([x, 0, 0]) + m.neutral() * 0, hold=["A"]).q for x in (0.1, 0.4)])
    v = np.array([m.consistent_velocity(x, rng.normal(size=m.nv), given=["A"]) for x in q])
    a = np.array([m.consistent_acceleration(x, y, rng.normal(size=m.nv), given=["A"]) for x, y in zip(q, v)])
    push = {"coupler": np.array([3.0, -20.0, 5.0, 1.0, 0.2, -3.0])}
    kind = np.float32 if single else np.float64
    found = m.reactions(*(x.astype(kind) for x in (q, v, a)), push, joints=["A", "B", "C", "D"], stiffness=given(0))
    near = [m.reactions(q, v, a, push, joints=["A", "B", "C", "D"], stiffness=given(k)) for k in (1e-3, 1e-4)]
    limit = near[1] + (near[1] - near[0]) / 9
    np.testing.assert_allclose(found, limit, atol=(2e-3 if single else 1e-8) * np.abs(limit).max())
    np.testing.assert_allclose(found[:, 3, 1], 0, atol=(1e-3 if single else 1e-11) * np.abs(limit).max())  # D's axis is y
    assert np.abs(found - m.reactions(q, v, a, push, joints=["A", "B", "C", "D"])).max() > 1e-2 * np.abs(limit).max(), "the least norm is something else"
    if not single:
        for k in range(2):
            np.testing.assert_allclose(m.with_stiffness(given(0)).reactions(q[k], v[k], a[k], push, joints=["A", "B", "C", "D"]), found[k], atol=1e-9)


def test_what_others_cannot_balance_is_transmitted():
    """One bearing that turns freely about z, without the other's help: the weight's moment has no other way."""
    b = ksl.Builder("arm").add_link("wall").add_link("arm", 2.0, (0.5, 0, 0), np.eye(3)).add_joint("hinge", "revolute", "wall", "arm", axis=(0, 0, 1))
    m = b.build()
    np.testing.assert_allclose(m.reactions([0.0], [0.0], [0.0], stiffness={"hinge": {"tilting": 0, "motion": 0}}), m.reactions([0.0], [0.0], [0.0]), atol=1e-14)


def test_a_skew_direction_and_a_joint_that_is_reversed():
    """About an axis that is none of the frame's; with the other root the same joint has the same zeros."""
    b = ksl.Builder("rotor").add_link("ground").add_link("shaft", MASS, (C * 0.6, C * 0.8, 0), np.diag([0.05, 0.09, 0.09]))
    b.add_joint("A", "continuous", "ground", "shaft", axis=(0.6, 0.8, 0))
    end = at([L * 0.6, L * 0.8, 0])
    m = (
        b.add_loop("B", "cylindrical", "ground", "shaft", end, end, axis=(0.6, 0.8, 0))
        .build(drives=["A"])
        .with_stiffness({"A": {"radial": 1e8, "tilting": 0}, "B": {"radial": 3e7, "tilting": 0}})
    )
    f = both(m)
    np.testing.assert_allclose(f[:, 2], [9.81 * MASS * (L - C) / L, 9.81 * MASS * C / L], rtol=1e-11)
    np.testing.assert_allclose(f[:, 3:], 0, atol=1e-10)
    reversed_one = m.with_root("shaft")
    assert np.allclose(np.reshape(dict(compliances_of(reversed_one))["A"][36:], (6, 6)), np.reshape(dict(compliances_of(m))["A"][36:], (6, 6)))


def test_what_fixes_the_root_gives_way_too_until_another_root_is_on_the_ground():
    b = ksl.Builder("arm").add_link("base").add_link("arm", 2.0, (0.5, 0, 0), np.eye(3)).add_joint("hinge", "revolute", "base", "arm", axis=(0, 1, 0))
    m = b.build()
    (ground,) = (joint.name for joint in m.joints if joint.parent is None)
    given = {"hinge": 50.0, ground: [1e5, 1e5, 1e5, 3e3, 0, 4e3]}
    stiff = m.with_stiffness(given)
    np.testing.assert_array_equal(stiff.modes([0.1]).frequencies, m.modes([0.1], given).frequencies)
    assert set(stiff.modes([0.1]).joints) == {"hinge", ground} and compliances_of(stiff) == {}
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(stiff)).modes([0.1]).frequencies, stiff.modes([0.1]).frequencies)
    assert stiff.with_payload("arm", 1.0).modes([0.1]).joints == stiff.modes([0.1]).joints
    left_out = 'the stiffness of the joint that fixes link "(on )?base" to the ground is left out'
    for other, now, joints in (
        (lambda: stiff.with_root("arm"), 'the ground carries link "arm"', {"hinge"}),
        (lambda: stiff.subtree("arm"), 'the ground carries link "arm"', set()),
        (lambda: m.merged(stiff, "arm", prefix="on "), 'joint "on mount" carries that link', {"on hinge"}),
    ):
        with pytest.warns(ksl.DescriptionWarning, match=f"{left_out}: {now}; give that joint a stiffness") as said:
            made = other()
        assert len(said) == 1 and set(made.modes(made.neutral() + 0.1).joints) == joints
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert stiff.subtree("base").modes([0.1]).joints == stiff.with_root("base").modes([0.1]).joints == stiff.modes([0.1]).joints
        assert stiff.without_loops().modes([0.1]).joints == stiff.modes([0.1]).joints
    with pytest.raises(ValueError, match="floating_base"):
        b.build(floating_base=True).with_stiffness({"floating_base": [1.0] * 6})


def test_zeros_are_kept():
    m = shaft().with_stiffness({"A": {"axial": 8e7, "radial": 1e8, "tilting": 0.0, "motion": 0}, "B": {"radial": 1e8, "tilting": 0.0}})
    numbers = compliances_of(m)
    assert {name: len(x) for name, x in numbers.items()} == {"A": 72, "B": 72}
    for same in (pickle.loads(pickle.dumps(m)), with_compliances(shaft(), numbers)):
        assert compliances_of(same) == numbers and np.array_equal(both(same), both(m))
    free = {"A": {"axial": 8e7, "radial": 1e8, "tilting": 0.0, "motion": 0}, "B": {"radial": 1e8, "tilting": 0.0}}
    np.testing.assert_allclose(m.modes([0.0], gravity=False).frequencies, shaft().modes([0.0], free, gravity=False).frequencies, rtol=1e-9, atol=1e-6)
    with pytest.raises(ValueError, match="reactions can't be generated for stiffnesses of 0 in loops"):
        m.compile(["reactions"])
