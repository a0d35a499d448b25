"""Calls whose arrays need no conversion, and those whose arrays do: the same bits and the same sentences."""

from collections import UserDict
from functools import partial

import numpy as np
import pytest
from random_states import random_states

import ksl
import ksl.mechanism.requests
import ksl.mechanism.states

NAMES = ["panda_link7", "panda_link3", "panda_flange"]
"""Of links that wrenches act on, in no order; the last is welded to its parent."""


def states(m, *leading):
    rng = np.random.default_rng(5)
    return *random_states(m, rng, *leading), {name: rng.normal(size=(*leading, 6)) for name in NAMES}


def calls(m, q, v, a, external):
    """Every call that takes external wrenches."""
    return {
        "inverse_dynamics": partial(m.inverse_dynamics, q, v, a, external),
        "forward_dynamics": partial(m.forward_dynamics, q, v, a, external),
        "bias": partial(m.bias, q, v, external),
        "gravity_torque": partial(m.gravity_torque, q, external),
        "reactions": partial(m.reactions, q, v, a, external, joints=["base", "panda_joint2"] if m.nq == m.nv else None, axes="world"),
    }


def long_way(m, q, v, a, external):
    """The same calls where no array is one of NumPy's."""
    return calls(m, *(memoryview(x) for x in (q, v, a)), None if external is None else {name: memoryview(w) for name, w in external.items()})


def said(call):
    with pytest.raises(Exception) as e:
        call()
    return type(e.value), str(e.value)


@pytest.fixture
def short_only(monkeypatch):
    """Fails where a call goes the long way."""

    def no(*_, **__):
        raise AssertionError("a call that needs no conversion went the long way")

    def forbid():
        monkeypatch.setattr(ksl.mechanism.states, "as_arrays", no)
        monkeypatch.setattr(ksl.mechanism.states, "as_rows", no)

    return forbid


# bits


@pytest.mark.parametrize("leading", [(), (1,), (21,), (3, 1, 5), (3000,)])
@pytest.mark.parametrize("how_many", [0, 1, 2, 3])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_external_wrenches_both_ways(arm, short_only, leading, how_many, dtype):
    q, v, a, external = states(arm, *leading)
    q, v, a = (x.astype(dtype) for x in (q, v, a))
    external = {name: external[name].astype(dtype) for name in NAMES[:how_many]}
    expected = {name: call() for name, call in long_way(arm, q, v, a, external).items()}
    short_only()
    for name, call in calls(arm, q, v, a, external).items():
        found = call()
        assert found.dtype == expected[name].dtype == dtype and np.array_equal(found, expected[name])
        out = np.full_like(found, np.nan)
        assert call(out=out) is out and np.array_equal(out, found)
        assert np.array_equal(call(threads=1), found)


@pytest.mark.parametrize("leading", [(), (4,)])
def test_reactions_both_ways(arm, short_only, leading):
    q, v, a, external = states(arm, *leading)
    names = [joint.name for joint in arm.joints]
    offset = [0.1, -0.0, 2]
    requests = [
        {},
        {"on": "parent", "order": "ang_lin"},
        {"part": "constraint", "at": "world", "axes": "world"},
        {"part": "actuation", "at": NAMES[0], "axes": NAMES[1]},
        {"joints": "panda_joint3"},
        *({"joints": given, "at": at} for given in (names, tuple(names)) for at in (offset, tuple(offset), np.array(offset), np.array(offset, np.float32))),
    ]
    lists = [x.tolist() for x in (q, v, a)]
    expected = [arm.reactions(*lists, wrenches, **keywords) for keywords in requests for wrenches in (None, UserDict(external))]
    short_only()
    for _ in range(2):  # with requests worked out anew, and with kept ones
        found = [arm.reactions(q, v, a, wrenches, **keywords) for keywords in requests for wrenches in (None, external)]
        assert all(np.array_equal(x, y) for x, y in zip(found, expected, strict=True))
        arm._requests.clear()
    assert np.array_equal(arm.reactions(q, v, a, joints=iter(names)), arm.reactions(q, v, a, joints=names))


@pytest.mark.parametrize("leading", [(), (1,), (21,), (4, 3), (3000,)])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_poses_and_energies_both_ways(arm, short_only, leading, dtype):
    q, v = (x.astype(dtype) for x in states(arm, *leading)[:2])
    wanted = [*arm.link_names, "panda_joint4"]
    poses, energies = [arm.frame_pose(memoryview(q), name) for name in wanted], arm.energy(memoryview(q), memoryview(v))
    several = arm.frame_poses(memoryview(q), wanted)
    short_only()
    for k, (name, pose) in enumerate(zip(wanted, poses, strict=True)):
        assert np.array_equal(arm.frame_pose(q, name), pose) and np.array_equal(several[..., k, :, :], pose)
    both_ways = [(arm.frame_poses(q, wanted), several), (arm.frame_poses(q), several[..., :-1, :, :]), *zip(arm.energy(q, v), energies, strict=True)]
    for found, expected in both_ways:
        assert type(found) is np.ndarray and found.dtype == dtype == expected.dtype and np.array_equal(found, expected)
    out, pair = np.full_like(several, np.nan), tuple(np.full_like(x, np.nan) for x in energies)
    assert arm.frame_poses(q, wanted, out=out, threads=1) is out and np.array_equal(out, several)
    assert all(x is y for x, y in zip(arm.energy(q, v, out=pair, threads=1), pair, strict=True)) and np.array_equal(pair, energies)
    pose = np.full_like(poses[0], np.nan)
    assert arm.frame_pose(q, wanted[-1], out=pose, threads=1) is pose and np.array_equal(pose, poses[-1])


def test_kept_requests_don_t_mix(arm):
    """Zeros of both signs, and offsets one after another, more than are kept."""
    q, v, a, _ = states(arm)
    minus, plus = ([zero, zero, zero] for zero in (-0.0, 0.0))
    assert arm.reaction_request("child", minus, "joint", "lin_ang", "total", None) is not arm.reaction_request("child", plus, "joint", "lin_ang", "total", None)
    for x in range(3 * ksl.mechanism.requests.REQUESTS_KEPT):
        arm.reactions(q, v, a, at=(x, 0, 0))
        assert len(arm._requests) <= ksl.mechanism.requests.REQUESTS_KEPT
    joints = ["panda_joint2"]
    first = arm.reactions(q, v, a, joints=joints)
    joints[0] = "panda_joint5"
    assert not np.array_equal(arm.reactions(q, v, a, joints=joints), first)


def test_results_over_external_wrenches(arm):
    """Wrenches are read before the result is written over them; results over other arguments are as without wrenches."""
    q, v, a, external = states(arm, 3000)
    memory = np.zeros((3000, arm.nv + 6))
    wrench = memory.reshape(-1)[: 3000 * 6].reshape(3000, 6)
    wrench[...] = external[NAMES[0]]
    expected = arm.inverse_dynamics(q, v, a, {NAMES[0]: wrench.copy()})
    out = memory.reshape(-1)[: 3000 * arm.nv].reshape(3000, arm.nv)
    assert np.array_equal(arm.inverse_dynamics(q, v, a, {NAMES[0]: wrench}, out=out), expected)
    expected = arm.inverse_dynamics(q, v, a, external)
    assert np.array_equal(arm.inverse_dynamics(q, v, a, external, out=a), expected)


# sentences


def test_what_is_wrong_with_wrenches_is_said_the_same_way(arm):
    for leading in ((), (21,)):
        q, v, a, external = states(arm, *leading)
        wrong = {
            "nan": external | {NAMES[1]: np.full_like(external[NAMES[1]], np.nan)},
            "shape": external | {NAMES[1]: np.zeros((*leading, 5))},
            "rows": external | {NAMES[1]: np.zeros((2, 7, 6))},
            "number": {NAMES[0]: np.zeros(())},
            "name": {"absent": external[NAMES[0]]},
            "no name": {3: external[NAMES[0]]},
            "half a letter": {"\ud800": external[NAMES[0]]},
            "complex": {NAMES[0]: external[NAMES[0]] * 1j},
        }
        sentences = {
            "nan": f"external['{NAMES[1]}'][{'0, ' if leading else ''}0] is nan; every number must be finite",
            "shape": f"external['{NAMES[1]}'] has shape {(*leading, 5)}; expected (…, 6): force, then moment",
            "number": f"external['{NAMES[0]}'] has shape (); expected (…, 6): force, then moment",
            "complex": f"external['{NAMES[0]}'] is complex (complex128); expected real numbers: .real takes the real parts",
        }
        for what, given in wrong.items():
            for name, call in calls(arm, q, v, a, given).items():
                if what == "rows" and not leading:
                    assert call().shape[:2] == (2, 7)
                    continue
                kind, sentence = said(call)
                assert (kind, sentence) == said(long_way(arm, q, v, a, given)[name])
                assert kind is ValueError and sentence == sentences.get(what, sentence)


def test_what_is_wrong_with_a_result_over_an_argument_is_said_with_wrenches_too(arm):
    q, v, a, external = states(arm, 40)
    a[39, 2] = np.nan
    kept = a.copy()
    with pytest.raises(ValueError, match=r"^a\[39, 2\] is nan; every number must be finite$"):
        arm.inverse_dynamics(q, v, a, external, out=a)
    assert np.array_equal(a, kept, equal_nan=True)
    a[39, 2] = 0
    external[NAMES[2]][39, 5] = np.inf
    with pytest.raises(ValueError, match=rf"^external\['{NAMES[2]}'\]\[39, 5\] is inf; every number must be finite$"):
        arm.inverse_dynamics(q, v, a, external, out=a)
    assert a[39, 2] == 0


def test_unknown_keywords_are_said_with_kept_requests_too(arm):
    q, v, a, _ = states(arm)
    arm.reactions(q, v, a, at=(1, 2, 3))  # equals the complex numbers below
    bad = [
        ({"on": "both"}, "on='both'; expected one of 'child', 'parent'"),
        ({"part": ["total"]}, "part=['total']; expected one of 'total', 'constraint', 'actuation', 'coupling'"),
        ({"order": None}, "order=None; expected one of 'lin_ang', 'ang_lin'"),
        ({"at": (1 + 0j, 2, 3)}, "at needs three finite numbers, found ((1+0j), 2, 3)"),
        ({"at": np.array([1, 2, 3 + 0j])}, "at needs three finite numbers, found array([1.+0.j, 2.+0.j, 3.+0.j])"),
        ({"at": (1, 2, np.nan)}, "at needs three finite numbers, found (1, 2, nan)"),
        ({"at": (1, 2)}, "at needs three finite numbers, found (1, 2)"),
        ({"at": None}, "at needs three finite numbers, found None"),
    ]
    for keywords, sentence in bad:
        for _ in range(2):
            with pytest.raises(ValueError) as e:
                arm.reactions(q, v, a, **keywords)
            assert str(e.value) == sentence
    for keywords in ({"axes": [0, 0, 1]}, {"axes": "absent"}, {"at": "absent"}):
        ((what, found),) = keywords.items()
        for _ in range(2):
            with pytest.raises(ValueError, match=f"^{what}="):
                arm.reactions(q, v, a, **keywords)
    for joints in (["absent"], "absent"):
        with pytest.raises(ValueError, match="no joint named 'absent'; known: "):
            arm.reactions(q, v, a, joints=joints)


def test_poses_and_energies_say_what_is_wrong(arm):
    q, v, _, _ = states(arm, 3)
    bad = q.copy()
    bad[2, 0] = np.nan
    for call in (lambda x: arm.frame_pose(x, NAMES[0]), lambda x: arm.energy(x, v)):
        assert said(lambda: call(bad)) == (ValueError, "q[2, 0] is nan; every number must be finite")
        assert said(lambda: call(q[:, 1:])) == (ValueError, f"q has shape (3, {arm.nq - 1}); expected (…, {arm.nq}): nq numbers for each state")
    assert said(lambda: arm.energy(q, [1.0])) == said(lambda: arm.energy(q, np.array([1.0])))
    for call in (lambda: arm.frame_pose(q, "absent"), lambda: arm.frame_poses(q, ["panda_link3", "absent"]), lambda: arm.frame_poses(q, "absent")):
        for _ in range(2):
            kind, sentence = said(call)
            assert kind is ValueError and "no link or joint named 'absent'; known: " in sentence and "panda_joint3" in sentence
    assert said(lambda: arm.energy(q, v, out=np.empty((2, 3)))) == (ValueError, "out is ndarray; expected two arrays, (kinetic, potential)")
    assert said(lambda: arm.energy(q, v, out=(np.empty(3), np.empty(2)))) == (
        ValueError,
        "out is float64 (2,); expected a C-contiguous, aligned, writeable float64 array of shape (3,)",
    )
    same = np.empty(3)
    assert said(lambda: arm.energy(q, v, out=(same, same))) == (ValueError, "out: kinetic, potential overlap; give each memory of its own")
    one, other = np.empty((2, 3, arm.nv, arm.nv))
    for out in ((one, one, other), (one, other, other), (one, other, one)):
        assert "overlap; give each memory of its own" in said(lambda out=out: arm.inverse_dynamics_derivatives(q, v, v, out=out))[1]
    for masked in (np.ma.zeros((3, arm.nv)), np.ma.masked_equal(np.zeros((3, arm.nv)), 0)):
        assert said(lambda masked=masked: arm.inverse_dynamics(q, v, v, out=masked)) == (
            ValueError,
            f"out is MaskedArray; expected a C-contiguous, aligned, writeable float64 array of shape (3, {arm.nv})",
        )
    for wrong in (lambda: arm.frame_poses(q, threads=-1), lambda: arm.frame_pose(q, NAMES[0], threads=-1), lambda: arm.energy(q, v, threads=-1)):
        assert said(wrong)[1].startswith("threads=-1; expected")


def test_energies_over_arguments(arm):
    """They would be written over numbers of other states."""
    q, v, _, _ = states(arm, 40)
    for k, name in enumerate("qv"):
        for place in range(2):
            given = [q.copy(), v.copy()]
            out = [np.empty(40), np.empty(40)]
            out[place] = given[k].reshape(-1)[3:43]
            assert f"out overlaps {name}" in said(lambda: arm.energy(*given, out=tuple(out)))[1]
            assert np.array_equal(given[0], q) and np.array_equal(given[1], v)


@pytest.mark.parametrize("n", [1, 21, 9000])
def test_energies_in_place_of_arguments(robot, n):
    """A state of one joint has as many numbers as its energy."""
    body = '<inertial><origin xyz="0.3 0 0"/><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    joint = '<joint name="j" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/></joint>'
    m = robot(f'<robot name="r"><link name="a"/><link name="b">{body}</link>{joint}</robot>')
    q, v = np.random.default_rng(3).normal(size=(2, n, 1))
    expected = m.energy(q, v)
    for first, second in (("q", "v"), ("v", "q"), ("q", None), (None, "v")):
        given = {"q": q.copy(), "v": v.copy()}
        out = tuple(given[name].reshape(n) if name else np.empty(n) for name in (first, second))
        found = m.energy(given["q"], given["v"], out=out)
        assert found[0] is out[0] and found[1] is out[1] and np.array_equal(out, expected)
    kept = {"q": q.copy(), "v": v.copy()}
    kept["v"][-1] = np.nan
    before = kept["q"].copy()
    with pytest.raises(ValueError, match=r"^v\[\d+, 0\] is nan"):
        m.energy(kept["q"], kept["v"], out=(kept["q"].reshape(n), np.empty(n)))
    assert np.array_equal(kept["q"], before)


def test_links_that_are_asked_for_are_kept(arm):
    q = states(arm)[0]
    names = ["panda_link2"]
    first = arm.frame_poses(q, names)
    names[0] = "panda_link5"
    assert not np.array_equal(arm.frame_poses(q, names), first)
    for n in range(3 * ksl.mechanism.requests.REQUESTS_KEPT):
        assert arm.frame_poses(q, names * n).shape == (n, 4, 4)
        assert len(arm._link_lists) <= ksl.mechanism.requests.REQUESTS_KEPT
    assert np.array_equal(arm.frame_poses(q, iter(arm.link_names)), arm.frame_poses(q))
