"""Which samples become cases: times, peaks, and few that keep a share, beside brute force and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from linkages import four_bar

import ksl
from ksl.parts.hull import extremes


@pytest.fixture(scope="module")
def run(examples):
    return ksl.compute_loads(examples / "robots" / "panda.urdf", examples / "motions" / "panda_pick.csv", payloads={"panda_flange": (2.0, (0, 0, 0.1))})


def share_by_directions(kept, vectors, directions):
    """The least, over linear functions, of what the kept reach of the largest magnitude."""
    return float((np.abs(kept @ directions).max(axis=0) / np.abs(vectors @ directions).max(axis=0)).min())


def test_peaks_are_the_largest_of_each_component_and_merged(run):
    joints = ["panda_joint2", "panda_joint4"]
    cases = ksl.free_bodies(run, joints=joints, links=["panda_link3"])
    motion = run.cases[0].motion
    f = run.model.reactions(motion.q, motion.resolved_v, motion.resolved_a, joints=joints)
    wanted = {}
    for j, name in enumerate(joints):
        for i, component in enumerate(("fx", "fy", "fz", "tx", "ty", "tz")):
            wanted.setdefault(int(np.abs(f[:, j, i]).argmax()), set()).add((name, component))
    assert {c.time: set(c.why) for c in cases} == {motion.time[k]: why for k, why in wanted.items()}
    assert [c.time for c in cases] == sorted(c.time for c in cases) and cases.share is None
    assert all(list(c.bodies) == ["panda_link3"] for c in cases)


def test_components_that_are_round_off_make_no_cases():
    """Of a planar linkage fy, tx and tz are: their peaks are wherever rounding is largest."""
    m = four_bar()
    t = np.linspace(0, 1, 60)
    run = ksl.compute_loads(m, (t, np.column_stack([0.4 + 0.5 * np.sin(3 * t), np.full((60, 2), np.nan)])))
    cases = ksl.free_bodies(run, joints=["A"])
    of_plane = {component: c.time for c in cases for joint, component in c.why if component in ("fx", "fz", "ty")}
    assert set(of_plane.values()) == {c.time for c in cases} and len(of_plane) == 3, cases


def test_given_times_are_those_of_samples_beside_them(run):
    t = run.cases[0].motion.time
    cases = ksl.free_bodies(run, times=[t[3] + 0.4 * (t[4] - t[3]), t[-1]])
    assert [c.time for c in cases] == [t[3], t[-1]] and cases[0].why == () and cases[0].reason == "given"
    one = run.model.free_bodies(*(x[3] for x in (run.cases[0].motion.q, run.cases[0].motion.resolved_v, run.cases[0].motion.resolved_a)))
    np.testing.assert_allclose(cases[0].bodies["panda_link2"].wrenches[0].wrench, one["panda_link2"].wrenches[0].wrench, rtol=1e-12)


def test_one_stress_needs_one_case_and_two_need_the_corners():
    """Of points on a circle, 2 n regular ones and their negatives, the n kept reach cos(π / 2n) of any direction: an inscribed polygon."""
    angle = np.linspace(0, np.pi, 721)[:-1]
    circle = np.column_stack([np.cos(angle), 50 * np.sin(angle)])  # an ellipse is a circle in other units
    kept, share = extremes(circle[:, :1])
    assert list(kept) == [0] and share == 1
    kept, share = extremes(circle, 6)
    assert len(kept) == 6 and share <= np.cos(np.pi / 12) + 1e-9
    gaps = np.diff([*angle[kept], angle[kept][0] + np.pi])
    np.testing.assert_allclose(share, np.cos(gaps.max() / 2), atol=2e-5)  # of the widest gap: a chord's distance
    square = np.array([[1.0, 1], [1, -1], [0.5, 0.2], [-0.3, 0.9], [-1, -1]])
    assert sorted(extremes(square)[0]) in ([0, 1], [1, 4]) and extremes(square)[1] == 1


@pytest.mark.parametrize("most", [5, 8, 12])
def test_a_share_is_what_no_direction_undercuts_and_some_direction_reaches(most):
    rng = np.random.default_rng(2)
    vectors = rng.normal(size=(80, 4)) * [1, 10, 0.1, 1e3]
    kept, share = extremes(vectors, most)
    assert len(kept) == most and 0 < share < 1
    K, W = vectors[kept], vectors
    corners = [np.linalg.solve(K[list(i)], s) for i in (rng.choice(most, 4, replace=False) for _ in range(3000)) for s in [rng.choice([-1.0, 1.0], 4)]]
    found = share_by_directions(K, W, np.column_stack(corners))
    np.testing.assert_allclose(found, share, rtol=1e-9)  # vertices of the polar body: the worst direction is one of them
    assert share_by_directions(K, W, (rng.normal(size=(2000, 4)) / [1, 10, 0.1, 1e3]).T) >= share


def test_fewer_cases_than_dimensions_keep_nothing(run):
    cases = ksl.free_bodies(run, instants="hull", links=["panda_link2"], most=3)
    assert len(cases) == 3 and cases.share == 0 and "keep nothing for certain" in cases.notes[0]
    assert len(ksl.free_bodies(run, instants="hull", links=["panda_link2"], most=1)) == 1
    assert extremes(np.zeros((5, 6)), 2) == (np.zeros(1), 1.0)


def test_a_stress_is_largest_in_one_of_several_load_cases():
    """A rod pulls by m c ω²: in the second case, at its third sample."""
    m = ksl.Builder("rod").add_link("base").add_link("rod", 2.0, (0.5, 0, 0), np.eye(3)).add_joint("hinge", "revolute", "base", "rod", axis=(0, 0, 1)).build()
    still, v = np.zeros((3, 1)), np.array([[0.0], [1], [9], [2]])
    slow, fast = (np.arange(3.0), still, still, still), (np.arange(4.0), np.zeros((4, 1)), v, np.zeros((4, 1)))
    each = [replace(ksl.compute_loads(m, motion).cases[0], name=name) for name, motion in (("slow", slow), ("fast", fast))]
    found = ksl.free_bodies(ksl.compute_loads(m, cases=each), stress={"rod": {"hinge": [1.0, 0, 0, 0, 0, 0]}})
    assert [(c.case, c.time) for c in found] == [("fast", 2.0)]


def test_stresses_and_sections_need_few_cases(run):
    link = "panda_link3"
    bending = np.zeros((2, 12))
    bending[0, 3], bending[1, 4] = 2e5, 3e5  # by tx and ty of the first joint, Pa per N m
    by_array = ksl.free_bodies(run, stress={link: bending}, most=3)
    by_name = ksl.free_bodies(run, stress={link: {"panda_joint3": bending[:, :6]}}, most=3)
    assert [c.time for c in by_array] == [c.time for c in by_name] and by_array.share == by_name.share > 0.8
    motion = run.cases[0].motion
    f = run.model.reactions(motion.q, motion.resolved_v, motion.resolved_a, joints=["panda_joint3"])[:, 0, 3:5]
    rows = [int(np.abs(motion.time - c.time).argmin()) for c in by_array]
    assert share_by_directions(f[rows], f, np.random.default_rng(0).normal(size=(2, 4000))) >= by_array.share - 1e-9
    cut = ksl.free_bodies(run, sections={link: [((0, 0, -0.1), (0, 0, 1))]}, most=9)
    loads = run.model.section_wrench(motion.q, motion.resolved_v, motion.resolved_a, link, (0, 0, -0.1), (0, 0, 1))
    rows = [int(np.abs(motion.time - c.time).argmin()) for c in cut]
    assert list(cut.shares) == [f"the section of {link}"] and len(cut) == 9
    assert share_by_directions(loads[rows], loads, (np.random.default_rng(0).normal(size=(4000, 6)) / np.abs(loads).max(axis=0)).T) >= cut.share > 0.2
    assert f"{cut.share:.2f} of whatever is linear" in cut.notes[0]


def test_stresses_of_sections_beside_those_of_wrenches(run):
    """The edge of a tube, N/A + M/W, needs the one sample where it is largest; share and beyond are those of section_wrench."""
    link, point, normal, motion = "panda_link3", (0, 0, -0.1), (0, 0, 1), run.cases[0].motion
    edge = np.array([0, 0, 1 / 8e-4, 0, 1 / 1.2e-5, 0])
    states = motion.q, motion.resolved_v, motion.resolved_a
    for more in ({}, {"share": 0.25}, {"beyond": ["panda_joint3"]}):
        loads = run.model.section_wrench(*states, link, point, normal, **more)
        (case,) = ksl.free_bodies(run, sections={link: [{"point": point, "normal": normal, "factors": edge, **more}]})
        assert case.time == motion.time[np.abs(loads @ edge).argmax()] and case.why == ((f"the section of {link}", "extreme"),)
    hinge = np.abs(run.model.reactions(*states, joints=["panda_joint6"])[:, 0, 3]).argmax()
    both = ksl.free_bodies(
        run, stress={"panda_link6": {"panda_joint6": [0, 0, 0, 1.0, 0, 0]}}, sections={link: [{"point": point, "normal": normal, "factors": edge, **more}]}
    )
    assert (
        {c.time for c in both} == {case.time, motion.time[hinge]}
        and list(both.shares) == ["stresses of panda_link6", f"the section of {link}"]
        and both.share == 1
    )
    assert set(both[0].bodies) == {link, "panda_link6"}


def test_factors_are_in_the_axes_of_the_part(run):
    """Those of the same stress in the link's axes and in those of a part choose the same sample."""
    link, pose = "panda_link3", ksl.Pose.from_rpy((0.1, 0, 0), (0.4, -1.1, 2.0))
    factor = np.array([[0, 10.0, 0, 2e5, 0, -3e4]])
    R = np.asarray(pose.matrix)[:3, :3]
    plain = ksl.free_bodies(run, stress={link: {"panda_joint3": factor}})
    (case,) = ksl.free_bodies(run, stress={link: {"panda_joint3": np.c_[factor[:, :3] @ R, factor[:, 3:] @ R]}}, frames={link: pose})
    wrench = next(w.wrench for w in case.bodies[link].wrenches if w.name == "panda_joint3")
    assert case.time == plain[0].time and case.time != ksl.free_bodies(run, stress={link: {"panda_joint3": factor}}, frames={link: pose})[0].time
    np.testing.assert_allclose(wrench @ np.r_[factor[0, :3] @ R, factor[0, 3:] @ R], plain[0].bodies[link].wrenches[0].wrench @ factor[0], rtol=1e-9)


BAD = {
    "two links of one body": ({"frames": {"panda_link7": np.eye(4), "panda_flange": np.eye(4)}}, "frames: panda_link7 and panda_flange are links of one body"),
    "stresses of two": ({"stress": {"panda_flange": [1], "panda_link7": [1]}}, "stress: panda_flange and panda_link7 are links of one body, panda_link7"),
    "another instant": ({"instants": "peak"}, "instants='peak'; did you mean 'peaks'"),
    "two": ({"instants": "hull", "times": [1]}, "times and instants: each says which instants"),
    "no motion then": ({"times": [99]}, "times: no motion at 99 s; panda_pick lasts from 0 s to"),
    "a link": ({"links": ["panda_link33"]}, "links: panda: no link named 'panda_link33'; did you mean"),
    "a joint": ({"joints": ["elbow"]}, "joints: panda: no joint named 'elbow'"),
    "a section of no link": ({"sections": {"hand": [((0, 0, 0), (0, 0, 1))]}}, "sections: panda: no link named 'hand'"),
    "a key of a section": ({"sections": {"panda_link3": [{"points": (0, 0, 0)}]}}, "a section has key='points'; did you mean 'point'"),
    "a section without normal": ({"sections": {"panda_link3": [{"point": (0, 0, 0)}]}}, "a section without normal"),
    "a section that is a number": ({"sections": {"panda_link3": [5]}}, r"5; expected \(point, normal\), or a mapping"),
    "a section without a list": ({"sections": {"panda_link3": {"point": (0, 0, 0)}}}, r"expected a list of \(point, normal\)"),
    "a section of three": ({"sections": {"panda_link3": [(0, 0, 1)]}}, r"expected \(point, normal\), or a mapping"),
    "factors of a section": (
        {"sections": {"panda_link3": [{"point": (0, 0, 0), "normal": (0, 0, 1), "factors": [1, 2]}]}},
        "the section of panda_link3: its factors have shape",
    ),
    "factors": ({"stress": {"panda_link3": [1, 2]}}, r"expected \(stresses, 12\): six factors for each of panda_joint3, panda_joint4"),
    "a wrench": ({"stress": {"panda_link3": {"x": [1] * 6}}}, "stress of panda_link3: no wrench named 'x'"),
    "none": ({"instants": "hull", "most": 0}, "most=0; expected a number of cases"),
    "a load case": ({"cases": ["lift"]}, "cases: the results: no load case named 'lift'; known:"),
    "a robot of a run": ({"robot": "panda.urdf"}, "a run has its robot"),
}


@pytest.mark.parametrize(("options", "said"), BAD.values(), ids=BAD)
def test_what_cannot_be_asked_is_said(run, options, said):
    with pytest.raises(ValueError, match=said):
        ksl.free_bodies(run, **options)


def test_lengths_in_millimetres_are_said(run):
    frames = {"panda_link3": ksl.Pose.from_rpy((0, 0, 80))}
    assert "the frame of panda_link3 is 80 m from the link's origin" in ksl.free_bodies(run, times=[0], frames=frames).notes[0]
