"""What calls take besides arrays: tables by the names of their columns, one number for all coordinates, typed wrenches."""

import warnings

import ksl
import numpy as np
import pyarrow as pa
import pytest
from growth import Name, assert_linear, work

ROLES = ("q", "v", "a")


@pytest.fixture(scope="module")
def ur5(examples):
    return ksl.load(examples / "robots/ur5.urdf")


@pytest.fixture(scope="module")
def mixed():
    """A floating base, a cylindrical joint and a hinge."""
    b = ksl.Builder("mixed")
    for name in ("body", "slider", "tip"):
        b.add_link(name, 1.0, (0.1, 0, 0), np.diag([0.1, 0.1, 0.1]))
    b.add_joint("rod", "cylindrical", "body", "slider", axis=(0, 0, 1)).add_joint("hinge", "revolute", "slider", "tip", axis=(0, 1, 0))
    return b.build(floating_base=True)


def states(m, n=4):
    rng = np.random.default_rng(1)
    return m.random(rng, n), rng.normal(size=(n, m.nv)), rng.normal(size=(n, m.nv))


def shuffled(x, names):
    """{column: numbers} in another order than the robot's."""
    order = np.random.default_rng(2).permutation(len(names))
    return {names[i]: x[..., i] for i in order}


def structured(columns):
    table = np.empty(len(next(iter(columns.values()))), [(name, float) for name in columns])
    for name, x in columns.items():
        table[name] = x
    return table


def pandas_frame(columns):
    return pytest.importorskip("pandas").DataFrame(columns)


def polars_frame(columns):
    return pytest.importorskip("polars").DataFrame(columns)


TABLES = {"pandas": pandas_frame, "polars": polars_frame, "pyarrow": pa.table, "numpy": structured, "mapping": dict}


@pytest.mark.parametrize("table", TABLES.values(), ids=TABLES)
def test_a_table_is_taken_by_name(ur5, table):
    q, v, a = states(ur5)
    expected = ur5.inverse_dynamics(q, v, a)
    given = [table(shuffled(x, ur5.joint_names)) for x in (q, v, a)]
    assert np.array_equal(ur5.inverse_dynamics(*given), expected)
    assert np.array_equal(ur5.reactions(*given), ur5.reactions(q, v, a))
    assert np.array_equal(ur5.frame_pose(given[0], "tool0"), ur5.frame_pose(q, "tool0"))


def test_one_table_of_a_motion_serves_all(ur5):
    """As a CSV file of a motion has it: time, positions, NAME.v and NAME.a."""
    q, v, a = states(ur5)
    whole = {"time": np.arange(4.0)} | shuffled(q, ur5.joint_names)
    whole |= shuffled(v, [f"{name}.v" for name in ur5.joint_names]) | shuffled(a, [f"{name}.a" for name in ur5.joint_names])
    assert np.array_equal(ur5.inverse_dynamics(*[pa.table(whole)] * 3), ur5.inverse_dynamics(q, v, a))
    del whole["elbow.v"]  # the position must not be taken for the velocity
    with pytest.raises(ValueError, match=r"v: columns are taken by name, and there is none for elbow\.v; did you mean"):
        ur5.inverse_dynamics(*[pa.table(whole)] * 3)


def test_work_is_linear_in_the_number_of_columns():
    """10,000 took 1.5 s."""
    from ksl.mechanism.joint_columns import by_name, endings_of
    from ksl.mechanism.joint_kinds import KINDS

    def take(n: int) -> None:
        names = [Name(f"j{k}") for k in range(n)]
        joints = [(str(name), endings_of(KINDS["revolute"])) for name in names]
        assert by_name(dict.fromkeys(names, 1.0), names, "q", joints).sum() == n
        with pytest.raises(ValueError, match=rf"none for j1, .* and {n // 2 - 12} more"):
            by_name(dict.fromkeys(names[::2], 1.0), names[::2], "q", joints)
        with pytest.raises(ValueError, match=f"'j{n - 1}' is that of 2 columns"):
            by_name(dict.fromkeys(names, 1.0), [*names, Name(f"j{n - 1}")], "q", joints)

    assert_linear(lambda n: work(lambda: take(n)), 100)


class Table(dict):
    """Tables that are put together count what is copied."""

    copied = 0

    def __or__(self, other):
        Table.copied += len(self) + len(other)
        return dict(self) | other


def test_the_first_request_of_reactions_takes_linear_time():
    def ask(n: int) -> int:
        b = ksl.Builder("chain").add_link("l0")
        for k in range(n):
            b.add_link(f"l{k + 1}", mass=1.0, inertia=np.eye(3)).add_joint(f"j{k}", "revolute", f"l{k}", f"l{k + 1}", axis=(0, 0, 1), limits=(-1, 1))
        m = b.build()
        m.__dict__["_joint_index"], Table.copied = Table(m._joint_index), 0
        assert m.reactions(m.neutral(), np.zeros(n), np.zeros(n)).shape == (n, 6)
        m._requests.clear()
        return work(m.reaction_request) + Table.copied

    assert_linear(ask, 30)


def test_joints_with_several_coordinates(mixed):
    q, v, a = states(mixed)
    names = {
        "q": [f"floating_base.{c}" for c in "x y z qx qy qz qw".split()] + ["rod.angle", "rod.travel", "hinge"],
        "v": [f"floating_base.{c}" for c in "vx vy vz wx wy wz".split()] + ["rod.angle.v", "rod.travel.v", "hinge.v"],
        "a": [f"floating_base.{c}" for c in "ax ay az bx by bz".split()] + ["rod.angle.a", "rod.travel.a", "hinge.a"],
    }
    given = [pa.table(shuffled(x, names[role])) for role, x in zip(ROLES, (q, v, a))]
    tau = mixed.inverse_dynamics(*given)
    assert np.array_equal(tau, mixed.inverse_dynamics(q, v, a))
    efforts = [f"floating_base.{c}" for c in "fx fy fz tx ty tz".split()] + ["rod.angle", "rod.travel", "hinge"]
    assert np.array_equal(mixed.forward_dynamics(given[0], given[1], pa.table(shuffled(tau, efforts))), mixed.forward_dynamics(q, v, tau))


def test_a_row_of_pandas_is_taken_by_name(ur5):
    pandas = pytest.importorskip("pandas")
    q = states(ur5)[0]
    frame = pandas.DataFrame(shuffled(q, ur5.joint_names))
    assert np.array_equal(ur5.mass_matrix(frame.iloc[2]), ur5.mass_matrix(q[2]))
    assert np.array_equal(ur5.mass_matrix(pandas.DataFrame(q)), ur5.mass_matrix(q)), "columns that are numbers are places"


def test_other_calls_take_tables_too(ur5):
    q, v, a = states(ur5, 8)
    time = np.arange(8.0)
    table = [pa.table(shuffled(x, ur5.joint_names)) for x in (q, v, a)]
    section = ("forearm_link", (0, 0, 0.1), (0, 0, 1))
    assert np.array_equal(ur5.section_wrench(*table, *section), ur5.section_wrench(q, v, a, *section))
    assert ur5.wrench_table(time, *table).equals(ur5.wrench_table(time, q, v, a))
    poses = ur5.frame_pose(q, "tool0")
    found = [ur5.inverse_kinematics("tool0", poses, q0=x, starts=1).q for x in (table[0], q)]
    assert np.array_equal(*found)


@pytest.mark.parametrize(
    ("columns", "sentence"),
    [
        ({"elbo": "elbow"}, "q: columns are taken by name, and there is none for elbow; did you mean 'elbo'?"),
        ({"elbow": None}, "there is none for elbow; columns: .*to_numpy"),
        ({"gripper": 0.0}, "'gripper' is that of no joint; leave it out"),
        ({"elbow": ["a", "b", "c", "d"]}, "q: column 'elbow' has no numbers"),
    ],
)
def test_columns_that_are_wrong(ur5, columns, sentence):
    table = dict(zip(ur5.joint_names, states(ur5)[0].T))
    for name, what in columns.items():
        if what is None:
            del table[name]
        elif isinstance(what, str):
            table[name] = table.pop(what)
        else:
            table[name] = np.broadcast_to(what, 4)
    with pytest.raises(ValueError, match=sentence):
        ur5.mass_matrix(pa.table(table))


def test_one_number_is_one_for_each_coordinate(ur5):
    q, v, a = states(ur5)
    zero = np.zeros_like(v)
    assert np.array_equal(ur5.inverse_dynamics(q, 0, 0), ur5.inverse_dynamics(q, zero, zero))
    assert np.array_equal(ur5.inverse_dynamics(0.5, v=0.0, a=np.float64(1)), ur5.inverse_dynamics(np.full(6, 0.5), np.zeros(6), np.ones(6)))
    assert np.array_equal(ur5.reactions(q, 0, np.array(0)), ur5.reactions(q, zero, zero))
    assert ur5.inverse_dynamics(q.astype(np.float32), 0, 0.0).dtype == np.float32, "numbers of Python have no precision"
    assert ur5.wrench_table(np.arange(4.0), q, 0, 0).equals(ur5.wrench_table(np.arange(4.0), q, zero, zero))


def test_typed_wrenches(ur5):
    q, v, a = states(ur5)
    numbers = np.random.default_rng(3).normal(size=(4, 6))
    expected = ur5.inverse_dynamics(q, v, a, {"tool0": numbers})
    wrench = ksl.Wrench(numbers, frame="tool0")
    for given in (wrench, wrench.named(None), wrench.in_order("ang_lin")):
        assert np.array_equal(ur5.inverse_dynamics(q, v, a, {"tool0": given}), expected)
    assert np.array_equal(ur5.inverse_dynamics(q, v, a, {np.str_("tool0"): numbers}), ur5.inverse_dynamics(q, v, a, {"tool0": numbers}))
    in_world = ur5.inverse_dynamics(q, v, a, {"tool0": numbers}, external_axes="world")
    assert np.array_equal(ur5.inverse_dynamics(q, v, a, {"tool0": ksl.Wrench(numbers)}, external_axes="world"), in_world)
    with pytest.raises(ksl.FrameError, match=r"external\['forearm_link'\] is Wrench\(frame='tool0'\); expected it in the frame 'forearm_link'"):
        ur5.inverse_dynamics(q, v, a, {"forearm_link": wrench})
    carried = ksl.Pose(ur5.relative_pose(q, "tool0", "forearm_link"), to="forearm_link", of="tool0") @ wrench  # as the sentence says
    found = ur5.inverse_dynamics(q, v, a, {"forearm_link": carried})
    assert found[:, :3] == pytest.approx(expected[:, :3], abs=1e-9), "the joints that carry both feel the same"


def test_limits_as_arrays():
    b = ksl.Builder("r")
    for name in ("base", "a", "b", "c", "d", "e"):
        b.add_link(name, 1.0, (0.1, 0, 0))
    b.add_joint("ball", "spherical", "base", "a")
    b.add_joint("lift", "prismatic", "a", "b", axis=(0, 0, 1), limits=(0.1, 0.5), effort=20, velocity=2)
    b.add_joint("spin", "continuous", "b", "c", axis=(0, 0, 1), effort=0, velocity=0)
    b.add_joint("rod", "cylindrical", "c", "d", axis=(0, 0, 1), limits=[None, (-1, None)])
    b.add_joint("twin", "prismatic", "b", "e", axis=(0, 0, 1), limits=(-0.6, -0.4), velocity=1, mimic=("lift", -2.0, 0.0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        m = b.build()
    inf = np.inf
    assert m.joint_names == ["ball", "lift", "spin", "rod"]
    assert m.lower.tolist() == [-inf] * 4 + [0.2, -inf, -inf, -1.0], "of the joint that follows at −2 ×: 0.2 to 0.3"
    assert m.upper.tolist() == [inf] * 4 + [0.3, inf, inf, inf]
    assert m.velocity_limit.tolist() == [inf] * 3 + [0.5, inf, inf, inf]
    assert m.effort_limit.tolist() == [inf] * 3 + [20.0, inf, inf, inf], "0 is no limit"
    for x, n in ((m.lower, m.nq), (m.upper, m.nq), (m.velocity_limit, m.nv), (m.effort_limit, m.nv)):
        assert x.shape == (n,)
        with pytest.raises(ValueError, match="read-only"):
            x[0] = 1


@pytest.mark.parametrize("bad", ["a", 2.5, [1], object()], ids=lambda bad: type(bad).__name__)
def test_numbers_of_threads(ur5, bad):
    with pytest.raises(ValueError, match="threads=.*expected how many threads"):
        ur5.mass_matrix(np.zeros(6), threads=bad)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda m: m.inverse_dynamics(object(), 0, 0), "q is .*expected numbers"),
        (lambda m: m.inverse_dynamics({}, 0, 0), "q is {}; expected numbers"),
        (lambda m: m.inverse_dynamics(0, 0, 0, {"tool0": "up"}), r"external\['tool0'\] is 'up'; expected numbers"),
        (lambda m: m.interpolate(np.zeros(6), np.zeros(6), "half"), "fraction is 'half'; expected numbers"),
        (lambda m: m.reactions(0, 0, 0, order="ang_li"), "order='ang_li'; did you mean 'ang_lin'"),
        (lambda m: m.inverse_dynamics(0, 0, 0, external_axes="wrld"), "did you mean 'world'"),
        (lambda m: m.inverse_dynamics(0, 0, 0, {"tol0": np.zeros(6)}), "no link named 'tol0'; did you mean 'tool0'"),
        (lambda m: m.with_root("tol0"), 'did you mean "tool0"'),
        (lambda m: m.section_wrench(0, 0, 0, "tool0", (0, 0, 0), (0, 0, 1), external={"tol0": np.zeros(6)}), "no link named 'tol0'; did you mean 'tool0'"),
        (lambda m: m.section_wrench(0, 0, 0, "tool0", (0, 0, 0), (0, 0, 1), beyond="tool_joint"), "no joint of tool0; did you mean 'tool0_joint'"),
        (lambda m: ksl.Twist(np.zeros(6), order="ang_lig"), "did you mean 'ang_lin'"),
        (lambda m: m.energy({"elbw": 1, "wrist_1": 0}, 0), "there is none for shoulder_pan.*did you mean 'elbw'"),
        (lambda m: m.with_root(3), "link is 3; expected a name"),
        (lambda m: m.with_frame([], "tool0"), r"name is \[\]; expected a name"),
        (lambda m: m.merged(m, "tool0", prefix=1), "prefix is 1; expected a name"),
        (lambda m: m.random(rng="seed"), "rng='seed'; expected a generator"),
        (lambda m: m.to_urdf(3.5), "path is float; expected the path"),
        (lambda m: m.wrench_table(np.arange(8.0), np.zeros((8, 6)), order="first"), "order='first'; expected one of"),
        (lambda m: m.wrench_table(np.arange(8.0), np.zeros((8, 6)), at=None), "at needs three finite numbers"),
        (lambda m: ksl.load(3), "path is int; expected the path"),
    ],
)
def test_what_arguments_are_not(ur5, call, sentence):
    """One sentence, and never an error of the interpreter's."""
    with pytest.raises(ValueError, match=sentence) as e:
        call(ur5)
    assert "\n" not in str(e.value)
