"""Closed mechanisms in parts: joints that transmit nothing, what is searched and closed, which samples are looked at, what is kept of many cases."""

from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pytest

import ksl
from ksl.load_cases import holding, loop_motion, undetermined
from ksl.load_cases.case_files import stops
from ksl.load_cases.case_result import compute_case
from ksl.load_cases.closed_mechanism import closed_mechanism, mobility_at_home
from ksl.load_cases.closed_poses import Reach, closed_pose, named_joints, reach_of
from ksl.load_cases.computed_cases import ComputedCases
from ksl.load_cases.load_case import LoadCase, Placement
from ksl.load_cases.passive_joints import passive, without_axial_effort
from ksl.load_cases.ranking import severity
from ksl.load_cases.reaction_joints import LoopJoint, has_drive, joint_named, reaction_joints, without_limits
from ksl.mechanism.mechanism import Joint
from ksl.motions.closing import Closing
from ksl.motions.motion import Motion
from linkages import FOURBAR, SLIDERCRANK


@pytest.fixture
def fourbar(robot):
    return robot(FOURBAR, drives=["A"])


def joint(name, kind="revolute", n=1, leader=None):
    return Joint(name, kind, "a", "b", n, n, 0, 0, (0.0, 0.0, 2.0), has_axis=n == 1, has_angle=kind != "prismatic", leader=leader)


TREE = [
    joint("A"),
    joint("slide", "prismatic"),
    joint("screw", "helical"),
    joint("leads"),
    joint("follows", leader="leads"),
    joint("weld", "fixed", 0),
    joint("ball", "spherical", 3),
]


@pytest.mark.parametrize(
    ("change", "idle"),
    [({}, "slide screw ball C"), ({"drives": ("slide", "ball")}, "A screw C"), ({"drives": None}, ""), ({"physics": ("damping",)}, ""), ({"loops": ()}, "")],
)
def test_joints_that_transmit_nothing_along_their_motion(fourbar, change, idle):
    """Without a motor, not coupled, and not welded; of joints with one coordinate, whose axis goes through the point, the wrench has no component there."""
    m = SimpleNamespace(**{"joints": tuple(TREE), "loops": fourbar.loops, "drives": ("A",), "physics": ()} | change)
    names = [j.name for j in reaction_joints(m)]
    of = lambda chosen: " ".join(name for name, yes in zip(names, chosen, strict=True) if yes)
    assert of(passive(m)) == idle
    for placement, off_axis in (
        (Placement(), ""), (Placement(at=(0.0, 0.0, -3.0)), "C"), (Placement(at=(0.0, -3.0, 0.0)), "A"), (Placement(at="world"), "AC"),
        (Placement(at="world", points={"A": (0, 0, 1), "C": (0, 0, 1)}), "C"), (Placement(points={"A": (1, 0, 0)}), "A"),
    ):  # fmt: skip
        wanted = [x for x in idle.split() if x not in ("screw", "ball") and x not in off_axis]
        assert of(without_axial_effort(m, placement)) == " ".join(wanted), placement


def test_joints_that_close_loops(fourbar):
    """They have links, an axis and a kind, and neither positions, limits nor a motor."""
    joints = reaction_joints(fourbar)
    assert [j.name for j in joints] == ["A", "B", "D", "base", "C"] and [without_limits(j) for j in joints] == [False] * 4 + [True]
    c = joint_named(fourbar, "C")
    assert isinstance(c, LoopJoint) and (c.parent, c.child, c.nq, c.nv, c.q_index, c.v_index) == ("coupler", "rocker", 0, 0, -1, -1)
    assert c.axis == (0, -1, 0) and c.has_axis and c.has_angle and c.one_coordinate and joint_named(fourbar, "B") is fourbar.joint("B")
    assert [has_drive(fourbar, j) for j in joints] == [True, False, False, False, False]
    assert [has_drive(fourbar.without_loops(), j) for j in joints] == [True, True, True, False, False] and not has_drive(fourbar, joint("x", leader="A"))
    assert [has_drive(SimpleNamespace(loops=(1,), drives=drives), joint("x")) for drives in (None, ("x",), ("y",))] == [True, True, False]


@pytest.mark.parametrize("drives", [["A"], None])
def test_freedoms_are_those_with_the_drives_at_zero(robot, drives):
    m = robot(FOURBAR, drives=drives)
    expected = m.mobility(m.close(np.clip(m.neutral(), m.lower, m.upper), hold=drives or ()).q)
    assert mobility_at_home(m) == (expected, "") and (expected.smallest != mobility_at_home(robot(FOURBAR))[0].smallest) == bool(drives)


def test_joints_that_a_pose_names(robot):
    m = robot(
        FOURBAR.replace(
            '<link name="frame"/>', '<link name="frame"/><link name="e"/><joint name="free" type="floating"><parent link="frame"/><child link="e"/></joint>'
        ),
        drives=["A"],
    )
    assert named_joints(m, None) == [] and named_joints(m, np.zeros(m.nq)) == [j.name for j in m.joints[:4]]
    assert sorted(named_joints(m, {"A": 1.0, "free.y": 2.0})) == ["A", "free"] and named_joints(m, {"free": [0] * 7}) == ["free"]


@pytest.mark.parametrize("crank", [-3.0, -1.2, -0.3, 0.0, 0.15, 0.9, 3.0])
def test_poses_are_closed_on_the_branch_of_their_beginning(fourbar, crank):
    """In steps so small that none goes to another one: as a hundred of them."""
    start = fourbar.close(fourbar.neutral(), hold=["A"]).q
    q = start.copy()
    for x in np.linspace(start[0], crank, 101):
        q[0] = x
        q = fourbar.close(q, hold=["A"]).q
    reach = reach_of(fourbar, start, set())
    aims = np.tile(start, (3, 1))
    aims[:, 0] = [crank, start[0], crank / 2]
    found, ok = reach.closed(aims)
    assert ok.all() and found[0] == pytest.approx(q, abs=1e-8) and found[1] == pytest.approx(start, abs=1e-9) and found[2, 0] == crank / 2
    assert reach.closed(aims[:1], q)[0][0] == pytest.approx(q, abs=1e-9), "from a pose nearby"
    assert np.abs(fourbar.loop_error(found)).max() < 1e-9


def test_what_is_searched_of_a_closed_mechanism(robot, fourbar):
    """Its drives; or what leaves as many free, where joints that follow stay.  Every second random pose is drawn nearer to the beginning, by k⁴."""
    start = fourbar.close(fourbar.neutral(), hold=["A"]).q
    moving = fourbar.joints[:3]
    assert [j.name for j in reach_of(fourbar, start, set()).searched(moving)] == ["A"] and [
        j.name for j in reach_of(fourbar, start, {"D"}).searched(moving)
    ] == ["D"]
    tree = Reach(fourbar, start, None)
    assert tree.searched(moving) == list(moving)
    tried = np.random.default_rng(2).random((9, 2))
    assert tree.nearer(tried.copy(), np.array([0.5, 2.0])) == pytest.approx(tried)
    near = reach_of(fourbar, start, set()).nearer(tried.copy(), np.array([0.25, 2.0]))
    begin, shares = np.array([0.25, 1.0]), (np.arange(5) / 4)[:, None] ** 4
    assert near[1::2] == pytest.approx(tried[1::2]) and near[::2] == pytest.approx((1 - shares) * begin + shares * tried[::2])


def test_poses_that_can_not_be_closed_are_skipped(robot):
    """A crank of 0.1 m is driven by its slide, which comes to 0.35 m or so: what is far from there has no size."""
    m = robot(SLIDERCRANK, drives=["S"])
    start = m.close(m.neutral(), hold=["A"]).q
    poses, k = np.tile(start, (4, 1)), m.joint("S").q_index
    poses[:, k] = start[k] + np.array([0.0, 0.5, -0.01, -0.9])
    reach = reach_of(m, start, set())
    sizes = reach.sizes(lambda q: 1 + q[:, k], poses)
    assert sizes.tolist() == pytest.approx([1 + start[k], 0, 0.99 + start[k], 0]) and reach.skipped == 2
    assert reach.sizes(lambda q: q[:, k], poses[:1]).tolist() == [pytest.approx(start[k])] and reach.skipped == 0


@pytest.mark.parametrize(("samples", "looked_at"), [(1, 1), (7, 7), (200, 200), (201, 200), (1001, 200)])
def test_samples_at_which_is_looked_what_is_open(fourbar, monkeypatch, samples, looked_at):
    """Two hundred at most, in equal steps, the first and the last among them."""
    seen = []
    monkeypatch.setattr(type(fourbar), "reactions_null_basis", lambda _, q, joints: seen.append(q[0]) or [])
    found = undetermined.undetermined(fourbar, np.arange(float(samples))[:, None] * [1, 0, 0], Placement())
    assert len(seen) == looked_at and (seen[0], seen[-1]) == (0, samples - 1) and not found.components
    assert np.ptp(np.diff(seen)) <= 1 if samples > 1 else True


def test_a_table_of_the_drives_alone(fourbar):
    """The columns of joints that follow need not be there; of a tree all must."""
    t = np.linspace(0, 1, 12)
    table = pa.table({"A": 0.3 * np.sin(t), "time": t})
    q = np.column_stack([0.3 * np.sin(t), np.full((12, 2), np.nan)])
    assert ksl.compute_loads(fourbar, table).rows == ksl.compute_loads(fourbar, (t, q)).rows
    with pytest.raises(ksl.MotionError, match="the table has no column 'B'"):
        ksl.compute_loads(fourbar.without_loops(), table)


@pytest.mark.parametrize(("joints", "most"), [(0, 5), (1, 5), (4, 5), (5, 4), (7, 3), (24, 1), (99, 1)])
def test_cases_whose_curves_are_kept(joints, most):
    """Five, with twenty-four curves in all of them, but one at least; of the joints that are wanted."""
    case = SimpleNamespace(joints=[joint(f"j{k}") for k in range(joints)] + [joint("other")], placement=SimpleNamespace(wanted=lambda name: name != "other"))
    assert ComputedCases([case], None)._most == most


def test_how_severe_a_case_is():
    """By colour, then by share, then by its largest effort of a drive or a brake."""
    of = lambda *uses, rows=(): severity(SimpleNamespace(uses=[SimpleNamespace(level=level, share=share) for level, share in uses], rows=rows))
    assert of() == (0, 0.0, 0.0) and of(("amber", 0.9), ("green", 2.0)) == (1, 0.9, 0.0) and of(("red", 1.1))[0] == 2
    assert of(rows=[{"effort_peak": 0.01}, {"brake_peak": 0.05, "effort_peak": None}]) == (0, 0.0, 0.05)


@pytest.mark.parametrize(("starts", "samples"), [(0, 21), (1, 21), (3120, 21), (3121, 21), (10000, 21), (5, 1 << 17)])
def test_starts_are_computed_in_parts(starts, samples):
    """All of them in order, each part with no more states than are computed at a time, if more than one start."""
    parts = stops._parts(np.arange(starts), samples)
    assert np.concatenate([*parts, []]).tolist() == list(range(starts))
    whole = max(1, stops.STATES // samples)
    assert all(len(part) == whole for part in parts[:-1]) and all(len(part) <= whole for part in parts)


def test_a_whole_pose_is_closed_on_its_own_branch(fourbar):
    """Where all joints are given; by the name of the drive alone, on that of the mechanism at home."""
    home = closed_pose(fourbar, fourbar.neutral(), ["A"])[0]
    other = fourbar.close([home[0], -home[1] - 2 * home[0], -home[2] + 0.3], hold=["A"]).q
    names = ["A", "B", "D"]
    assert np.abs(fourbar.difference(home, other)).max() > 0.5 and np.abs(fourbar.loop_error(other)).max() < 1e-9, "there are two ways to close a four-bar"
    for q in (home, other):
        found, closing = closed_pose(fourbar, q, names)
        assert found == pytest.approx(q, abs=1e-8) and closing.held == ("A",) and closing.error < 1e-9
    assert closed_pose(fourbar, other, ["A"])[0] == pytest.approx(home, abs=1e-8)


def test_where_random_poses_are_drawn_near(robot, monkeypatch):
    """To the share of its range at which each drive begins."""
    begins = []
    monkeypatch.setattr(Reach, "nearer", lambda self, tried, start: begins.append(start) or tried)
    monkeypatch.setattr(holding, "TRIED", 12)
    for lower, upper in ((0.2, 0.5), (0.3, 0.45)):
        m = robot(SLIDERCRANK.replace('lower="0" upper="1"', f'lower="{lower}" upper="{upper}"'), drives=["S"])
        slide, q = m.joint("S").q_index, m.close(m.neutral(), hold=["A"]).q
        q = reach_of(m, q, set()).closed(np.where(np.arange(3) == slide, 0.34, q)[None])[0][0]
        found = holding.worst_pose(m, "C", "radial_force", Placement(), q, set())
        assert 0 < found.skipped < found.tried == 12 and found.refined == 12 - found.skipped, "what was not closed is not refined"
        assert begins[-1] == pytest.approx((0.34 - lower) / (upper - lower))


def turned(axis, angle):
    """(4, 4): Rodrigues."""
    x, y, z = axis
    W = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.block([[np.eye(3) + np.sin(angle) * W + (1 - np.cos(angle)) * W @ W, np.zeros((3, 1))], [np.zeros((1, 3)), np.ones((1, 1))]])


@pytest.mark.parametrize(("kind", "pitch"), [("revolute", 0.0), ("helical", 0.01), ("helical", 0.0), ("prismatic", 0.0)])
@pytest.mark.parametrize("begin", [0.5, 4.0, -10.0])
def test_positions_of_loop_joints(kind, pitch, begin):
    """A screw turns as often as its travel says; a hinge begins within half a turn; both go on without jumps, and all between two links anywhere."""
    axis, rng = np.array([0.6, 0.64, 0.48]), np.random.default_rng(1)
    frames = [turned([0, 0.6, 0.8], 0.4), turned([1, 0, 0], 1.1)]
    for frame in frames:
        frame[:3, 3] = rng.normal(size=3)
    x, poses = begin + np.linspace(0, 7, 15), []
    for position in x:
        link, moved = turned([0, 0, 1], 0.3 * position), turned(axis, position if kind != "prismatic" else 0.0)
        link[:3, 3] = rng.normal(size=3)
        moved[:3, 3] = (position if kind == "prismatic" else pitch * position) * axis
        poses.append([link, link @ frames[0] @ moved @ np.linalg.inv(frames[1])])
    still = lambda *_, **__: np.zeros((15, 2, 6))
    model = SimpleNamespace(frame_poses=lambda *_: np.array(poses), frame_velocities=still, frame_accelerations=still)
    loop = SimpleNamespace(
        predecessor="a", successor="b", axis=tuple(axis), kind=kind, pitch=pitch, predecessor_pose=frames[0].ravel(), successor_pose=frames[1].ravel()
    )
    found = loop_motion._of_loop(model, loop, *np.zeros((3, 15, 1))).position
    assert found == pytest.approx(x - 2 * np.pi * np.round(begin / (2 * np.pi)) if kind != "prismatic" and not pitch else x, abs=1e-9)


def test_points_about_which_is_looked_what_is_open():
    """In the joint's axes, from its origin: of the world's origin, of a link's, or given."""
    own, link = turned([0.6, 0, 0.8], 0.7), turned([0, 1, 0], 0.2)
    own[:3, 3], link[:3, 3] = [1, 2, 3], [-4, 5, 0.5]
    model = SimpleNamespace(frame_pose=lambda q, name: {"hand": link}[name])
    for at, origin in (("world", np.zeros(3)), ("hand", link[:3, 3])):
        point = undetermined._point(model, None, at, own)
        assert own @ [*point, 1] == pytest.approx([*origin, 1])
    point, force = np.array([1.0, 2, 3]), np.array([0.0, 5, 0])
    model.frame_poses = lambda q, names: np.array([own])
    ((here, turned_there),) = undetermined._placed(
        model, None, (joint("A"),), np.array([[[*force, *np.cross(point, force)]]]), Placement(at=tuple(point), axes="hand")
    )
    assert here == pytest.approx(np.array([[*force, 0, 0, 0]])) and turned_there[0, :3] == pytest.approx(link[:3, :3].T @ own[:3, :3] @ force)
    assert undetermined._point(model, None, (1, 2, 3), own).tolist() == [1, 2, 3]
    assert undetermined._axes(model, None, "world").tolist() == np.eye(3).tolist() and undetermined._axes(model, None, "hand") == pytest.approx(link[:3, :3])


def test_closed_mechanisms_in_words(robot):
    """The largest error of closure, its time, and its case where there are several; no closure where positions were not closed."""
    m = robot(FOURBAR, drives=["A"])
    q = m.close(m.neutral(), hold=["A"]).q[None]
    cases = [
        LoadCase(m, Motion(np.zeros(1), q, *np.zeros((2, 1, 3)), closing=x and Closing(("A",), *x, (), 1)), name=name)
        for name, x in (("none", None), ("small", (1e-12, 0.25)), ("large", (3e-11, 0.75)))
    ]
    found = [closed_mechanism(some) for some in (cases[:1], cases[2:], cases)]
    assert [(x.held, x.error, x.error_time, x.error_case) for x in found] == [((), 0.0, 0.0, ""), (("A",), 3e-11, 0.75, ""), (("A",), 3e-11, 0.75, "large")]
    assert [dict(x.lines()).get("closure") for x in found] == [None, "largest error 3e-11 m, at 0.75 s", "largest error 3e-11 m, at 0.75 s of large"]
    assert dict(found[1].lines()) | {"closure": ""} == {
        "loops": "C, continuous, coupler → rocker", "freedoms": "1, driven by A", "positions": "given for A; all others follow", "redundant equations": "C: 3 of 5",
        "stiffnesses": "none: all joints are rigid", "closure": "",
    }  # fmt: skip
    for drives, freedoms, brake, doubted in (("A", 1, False, 0), ("AD", 1, False, 1), ("AD", 2, False, 0), ("AD", 1, True, 0)):
        motion = Motion(np.zeros(1), q, *np.zeros((2, 1, 3)), closing=Closing(("A",), 0.0, 0.0, (), freedoms))
        doubts = compute_case(LoadCase(robot(FOURBAR, drives=list(drives)), motion, brakes_from=0.0 if brake else 0.1)).doubts
        assert len([line for line in doubts if line.startswith("A, D: 2 drives move 1 freedom: ")]) == len(doubts) == doubted
