"""ksl.motions: reading, differentiating, and every sentence about what can't be used."""

import numpy as np
import pytest

import ksl
from ksl.mechanism.joint_kinds import columns_of
from ksl.motions.motion import Motion, _jumps, complete
from ksl.motions.reading import read_external, read_motion
from ksl.motions.signal.quality import Samples
from ksl.motions.signal.rates import derivative
from ksl.motions.signal.splines import spline_through

INERTIAL = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'

TWO = f"""<robot name="two"><link name="a"/><link name="b"/><link name="c">{INERTIAL}</link>
<joint name="hip" type="revolute"><parent link="a"/><child link="b"/><limit lower="-9" upper="9" effort="9" velocity="9"/></joint>
<joint name="knee" type="revolute"><parent link="b"/><child link="c"/><limit lower="-9" upper="9" effort="9" velocity="9"/></joint></robot>"""


@pytest.fixture
def two(robot) -> ksl.Model:
    return robot(TWO)


def csv(columns: dict[str, np.ndarray]) -> str:
    rows = zip(*columns.values())
    return ",".join(columns) + "\n" + "".join(",".join(repr(float(x)) for x in row) + "\n" for row in rows)


def good(n: int = 8, **changed: str) -> list[str]:
    """Lines of a motion of `two`."""
    return ["time,hip,knee"] + [f"{0.1 * k:.1f},{0.01 * k},{-0.02 * k}" for k in range(n)]


# what is read


def test_columns_in_any_order_and_rates_as_given(two, written):
    t = np.linspace(0, 1, 5)
    table = {"knee.a": t + 6, "hip": t + 1, "time": t, "knee": t + 2, "hip.v": t + 3, "hip.a": t + 5, "knee.v": t + 4}
    m = read_motion(two, written(csv(table)))
    assert np.array_equal(m.time, t) and m.differentiated == []
    assert np.array_equal(m.q, np.stack([t + 1, t + 2], axis=1))
    assert np.array_equal(m.v, np.stack([t + 3, t + 4], axis=1))
    assert np.array_equal(m.a, np.stack([t + 5, t + 6], axis=1))


def test_forms_of_files_that_are_read_alike(two, written):
    """Windows line ends, a byte-order mark, quoted names, blanks after commas in the header, no newline at the end."""
    lines = good()
    plain = read_motion(two, written("\n".join(lines) + "\n"))
    forms = {
        "windows": "\r\n".join(lines) + "\r\n",
        "mark": b"\xef\xbb\xbf" + ("\n".join(lines) + "\n").encode(),
        "quoted": "\n".join(['"time", "hip", "knee"', *lines[1:]]) + "\n",
        "spreadsheet": "\n".join(l + ",," for l in lines) + "\n",
        "unended": "\n".join(lines),
    }
    for name, text in forms.items():
        found = read_motion(two, written(text))
        assert np.array_equal(found.q, plain.q) and np.array_equal(found.time, plain.time), name


def test_joints_with_commas_and_quotes_in_their_names(robot, written):
    m = robot(TWO.replace('"hip"', '"hip, left"').replace('"knee"', "'the \"knee\"'"))
    table = '"time","hip, left","the ""knee"""\n' + "\n".join(good()[1:])
    assert np.array_equal(read_motion(m, written(table)).q[:, 1], [-0.02 * k for k in range(8)])


def test_what_is_differentiated_is_said(two, written):
    t = np.linspace(0, 1, 9)
    position = {"time": t, "hip": np.sin(t), "knee": np.cos(t)}
    said = lambda **more: read_motion(two, written(csv(position | {k.replace("_", "."): x for k, x in more.items()}))).differentiated
    assert said() == ["velocities and accelerations of all joints differentiated from a quintic spline through the samples"]
    assert said(hip_v=np.cos(t), hip_a=-np.sin(t)) == ["velocities and accelerations of knee differentiated from a quintic spline through the samples"]
    assert said(hip_v=np.cos(t), knee_a=-np.cos(t)) == [
        "accelerations of hip differentiated from a quintic spline through the samples",
        "velocities of knee differentiated from a quintic spline through the samples",
    ]


def test_numbers_of_a_sample_motion(examples):
    m = ksl.load(examples / "robots" / "ur5.urdf")
    motion = read_motion(m, examples / "motions" / "ur5_pick.csv")
    assert motion.q.shape == motion.v.shape == motion.a.shape == (len(motion.time), 6)
    assert np.allclose(np.diff(motion.time), 0.004)
    # the motion starts and ends at rest
    assert np.abs(motion.v[[0, -1]]).max() < 1e-4 and np.abs(motion.a[[0, -1]]).max() < 0.05


# derivatives


@pytest.mark.parametrize("uneven", [False, True])
def test_derivatives_of_quintics_are_exact(two, uneven):
    rng = np.random.default_rng(2)
    t = np.sort(rng.uniform(0, 2, 14)) if uneven else np.linspace(0, 2, 14)
    c = rng.normal(size=(6, 2))
    power = lambda k: np.polynomial.polynomial.polyval(t, np.polynomial.polynomial.polyder(c, k)).T
    m = complete(two, t, power(0), [[None, None]] * 2)
    assert m.v == pytest.approx(power(1), rel=1e-8, abs=1e-8)
    assert m.a == pytest.approx(power(2), rel=1e-6, abs=1e-6)
    # with velocities given, accelerations are the first derivative of those
    m = complete(two, t, power(0), [[power(1)[:, :1], None], [power(1)[:, 1:], None]])
    assert np.array_equal(m.v, power(1)) and m.a == pytest.approx(power(2), rel=1e-8, abs=1e-8)
    # with accelerations given, these are kept
    m = complete(two, t, power(0), [[None, power(2)[:, :1] + 1]] * 2)
    assert np.array_equal(m.a[:, 0], power(2)[:, 0] + 1) and m.v[:, 0] == pytest.approx(power(1)[:, 0], rel=1e-8, abs=1e-8)


def test_derivatives_converge_at_the_splines_order():
    """Half the step: first derivatives 2⁵ times better, second ones 2⁴ times, away from the ends."""

    def error(n, order):
        t = np.linspace(0, 3, n)
        exact = np.cos(2 * t) * 2 if order == 1 else -np.sin(2 * t) * 4
        return np.abs(derivative(t, np.sin(2 * t), order) - exact)[n // 4 : -n // 4].max()

    assert error(31, 1) / error(61, 1) > 2**5 * 0.8
    assert error(31, 2) / error(61, 2) > 2**4 * 0.8


def turning(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A body on a path, turned by Rz(α) Rx(β): q, v, a in closed form."""
    al, al1, al2 = 3 * np.sin(t), 3 * np.cos(t), -3 * np.sin(t)
    be, be1, be2 = t + t**2, 1 + 2 * t, 2 + 0 * t
    p, p1, p2 = (
        np.stack(x, axis=1) for x in ((np.sin(t), t**2, np.cos(2 * t)), (np.cos(t), 2 * t, -2 * np.sin(2 * t)), (-np.sin(t), 2 + 0 * t, -4 * np.cos(2 * t)))
    )
    ca, sa, cb, sb = np.cos(al / 2), np.sin(al / 2), np.cos(be / 2), np.sin(be / 2)
    quaternion = np.stack([ca * sb, sa * sb, sa * cb, ca * cb], axis=1)
    w = np.stack([be1, al1 * np.sin(be), al1 * np.cos(be)], axis=1)
    dw = np.stack([be2, al2 * np.sin(be) + al1 * be1 * np.cos(be), al2 * np.cos(be) - al1 * be1 * np.sin(be)], axis=1)
    one, zero = np.ones_like(t), np.zeros_like(t)
    matrix = lambda rows: np.array([[np.broadcast_to(x, t.shape) for x in row] for row in rows]).transpose(2, 0, 1)
    R = matrix([[np.cos(al), -np.sin(al), zero], [np.sin(al), np.cos(al), zero], [zero, zero, one]]) @ matrix(
        [[one, zero, zero], [zero, np.cos(be), -np.sin(be)], [zero, np.sin(be), np.cos(be)]]
    )
    into_body = lambda x: np.einsum("nij,ni->nj", R, x)
    v = into_body(p1)
    return np.hstack([p, quaternion]), np.hstack([v, w]), np.hstack([into_body(p2) - np.cross(w, v), dw])


def test_velocities_of_a_floating_base_whose_accelerations_are_given(flying):
    t = np.linspace(0, 2, 801)
    q, v, a = turning(t)
    found = complete(flying, t, q, [[None, a]])
    assert found.v == pytest.approx(v, abs=1e-6) and np.array_equal(found.a, a)


def test_accelerations_are_those_of_the_unit_quaternion_between_samples(flying):
    """Samples are far apart, so that the spline's length changes at them: against differences of the twist of its direction, a millisecond to both sides."""
    t = np.linspace(0, 2, 9)
    q, _, _ = turning(t)
    spline, dt = spline_through(t, q[:, 3:]), 1e-3

    def twist(at):
        n, n1 = spline(at), spline(at, nu=1)
        return 2 * (n[:, 3:] * n1[:, :3] - n1[:, 3:] * n[:, :3] - np.cross(n[:, :3], n1[:, :3])) / np.sum(n * n, axis=1, keepdims=True)

    growth = np.abs(np.sum(spline(t) * spline(t, nu=1), axis=1)).max()
    found = complete(flying, t, q, [[None, None]])
    assert growth > 0.01 and found.v[:, 3:] == pytest.approx(twist(t), abs=1e-9)
    assert found.a[:, 3:] == pytest.approx((twist(t + dt) - twist(t - dt)) / (2 * dt), abs=1e-3)


def floating_table(t, q) -> dict[str, np.ndarray]:
    return {"time": t, **{f"floating_base.{c}": q[:, i] for i, c in enumerate(("x", "y", "z", "qx", "qy", "qz", "qw"))}}


def test_rates_of_a_floating_base(flying, written):
    t = np.linspace(0, 2, 801)
    q, v, a = turning(t)
    m = read_motion(flying, written(csv(floating_table(t, q))))
    assert np.abs(m.q - q).max() < 1e-14
    assert np.abs(m.v - v).max() < 1e-7
    assert np.abs(m.a - a).max() < 1e-4


def test_quaternions_may_change_sign_and_be_slightly_off(flying, written):
    t = np.linspace(0, 2, 201)
    q, _, _ = turning(t)
    expected = read_motion(flying, written(csv(floating_table(t, q))))
    flipped = q.copy()
    rng = np.random.default_rng(0)
    flipped[1:, 3:] *= rng.choice([-1, 1], (200, 1)) * (1 + 4e-4 * rng.uniform(-1, 1, (200, 1)))
    found = read_motion(flying, written(csv(floating_table(t, flipped))))
    for name in ("q", "v", "a"):
        assert np.abs(getattr(found, name) - getattr(expected, name)).max() < 1e-7, name


def test_rates_of_a_floating_base_as_given(flying, written):
    t = np.linspace(0, 1, 12)
    q, v, a = turning(t)
    table = floating_table(t, q) | {f"floating_base.{c}": v[:, i] for i, c in enumerate(("vx", "vy", "vz", "wx", "wy", "wz"))}
    m = read_motion(flying, written(csv(table)))
    assert np.array_equal(m.v, v) and m.a == pytest.approx(derivative(t, v), rel=1e-12, abs=1e-12)
    table |= {f"floating_base.{c}": a[:, i] for i, c in enumerate(("ax", "ay", "az", "bx", "by", "bz"))}
    m = read_motion(flying, written(csv(table)))
    assert np.array_equal(m.v, v) and np.array_equal(m.a, a) and m.differentiated == []


# what is refused


def refusal(model, path, read=read_motion, *more) -> str:
    with pytest.raises(ksl.MotionError) as e:
        read(model, path, *more)
    text = str(e.value)
    assert "\n" not in text and str(path) in text, text
    return text[text.index(str(path)) + len(str(path)) :]


def changed(line: int, text: str, n: int = 8) -> str:
    """A good motion whose line (from 1) is replaced."""
    lines = good(n)
    lines[line - 1] = text
    return "\n".join(lines) + "\n"


BAD = {
    "a word": (changed(4, "0.2,left,0"), ":4: column 'hip' holds 'left'; expected a number with a decimal point"),
    "a decimal comma": (changed(4, '0.2,"0,5",0'), ":4: column 'hip' holds '0,5'; expected a number with a decimal point"),
    "too many values": (changed(5, "0.3,0,5,0"), ":5: 4 values in a table of 3 columns; separate values by commas, numbers with a decimal point"),
    "too few values": (changed(5, "0.3,0"), ":5: 2 values in a table of 3 columns; separate values by commas"),
    "infinite": (changed(6, "0.4,inf,0"), ":6: column 'hip' is infinite; every sample needs a finite number"),
    "time missing": (changed(6, ",0,0"), ":6: column 'time' is not a number or missing"),
    "time standing still": (
        "time,hip,knee\n" + "".join(f"{k // 2},0,0\n" for k in range(8)),
        ":3: 4 of 8 samples have the time of another: the times have too few digits, or aren't those of the samples",
    ),
    "time going back": (changed(6, "-0.25,0,0"), ":6: time -0.25 after 0.3; times must increase"),
    "no numbers": ("time,hip,knee\n" + "".join(f"{k},{k},\n" for k in range(8)), ": the positions of knee are not numbers in any sample"),
    "no time": (changed(1, "x,hip,knee"), ":1: no column `time`; found x, hip, knee"),
    "slip of the pen": (changed(1, "time,hip,kne"), ":1: unknown column 'kne'; did you mean 'knee'?"),
    "stranger": (changed(1, "time,hip,zzzzzz"), ":1: unknown column 'zzzzzz'; the moving joints of two are hip, knee"),
    "joint missing": ("time,hip\n0,0\n1,0\n", ":1: no column 'knee' for joint knee; add its positions (rad) at every sample"),
    "two of a name": (changed(1, "time,hip,hip"), ":1: two columns are named 'hip'; rename or remove one"),
    "few samples": ("\n".join(good(5)), ": 5 samples, but differentiating hip, knee needs at least 6; add samples, or give the columns hip.v and hip.a"),
    "one sample": ("time,hip,hip.v,hip.a,knee,knee.v,knee.a\n0,0,0,0,0,0,0\n", ": 1 sample, but means over time need at least 2; add samples"),
    "header only": ("time,hip,knee\n", ": 0 samples, but differentiating hip, knee needs at least 6; add samples"),
    "header without end": ("time,hip,knee", ": holds no samples; give `time` and a column for each joint, a line for each sample"),
    "empty": ("", ": holds no samples; give `time` and a column for each joint, a line for each sample"),
    "no names": ("\n0,0,0\n", ":2: no names of columns, but numbers; give a CSV file"),
    "names that are blank": (",,\n0,0,0\n", ":1: no names of columns; give a CSV file"),
    "value without a column": ("time,hip,knee,,\n0,0,0,,\n1,0,0,,note\n", ":3: 'note' in column 5, which has no name; name it in line 1, or remove"),
    "one value": (changed(5, "0.3"), ":5: 1 value in a table of 3 columns;"),
    "one column": ("time\n0\n1,2\n", ":1: no column 'hip' for joint hip; add its positions"),
    "one sample to differentiate": ("\n".join(good(1)), ": 1 sample, but differentiating hip, knee needs at least 6"),
    "no floating base": (
        changed(1, "time,hip,floating_base.x"),
        ":1: unknown column 'floating_base.x'; if the root link floats, load the robot with --floating-base",
    ),
    "binary": (b"\xff\xfe\x00\x01\n", ": line 1 is not text; give a CSV file with `time` and a column for each joint"),
}


@pytest.mark.parametrize("what", BAD)
def test_files_that_are_refused(two, written, what):
    text, sentence = BAD[what]
    found = refusal(two, written(text))
    assert sentence in found


def test_a_fault_far_down_is_found_with_its_line(two, written):
    """Beyond the first block that the CSV reader takes in."""
    lines = ["time,hip,knee"] + [f"{k},0.123456789012345,0.123456789012345" for k in range(100_000)]
    lines[90_000] = "89999,0,wrong"
    assert refusal(two, written("\n".join(lines))).startswith(":90001: column 'knee' holds 'wrong'")
    lines[90_000] = "89999,0"
    assert refusal(two, written("\n".join(lines))).startswith(":90001: 2 values in a table of 3 columns")


def test_a_blank_line_at_the_end_is_no_fault(two, written):
    plain, ended = (read_motion(two, written("\n".join(good()) + end)) for end in ("\n", "\n\n"))
    assert np.array_equal(plain.q, ended.q)


def test_no_file(two, tmp_path):
    assert "can't be read (No such file or directory); give a CSV file" in refusal(two, tmp_path / "absent.csv")
    assert "can't be read" in refusal(two, tmp_path)


def test_columns_of_a_floating_base_that_has_another_name(robot, written):
    """Where the file has a joint named floating_base, which is welded here."""
    weld = '<joint name="floating_base" type="fixed"><parent link="stone"/><child link="sensor"/></joint>'
    with pytest.warns(ksl.DescriptionWarning, match="called floating_root"):
        m = robot(f'<robot name="r"><link name="stone">{INERTIAL}</link><link name="sensor"/>{weld}</robot>', floating_base=True)
    t = np.linspace(0, 1, 8)
    q = np.stack([t, 0 * t, t**2, *(0 * t for _ in range(3)), 1 + 0 * t], axis=1)
    text = csv(floating_table(t, q))
    assert "unknown column 'floating_base.x'; did you mean 'floating_root.x'?" in refusal(m, written(text))
    assert np.array_equal(read_motion(m, written(text.replace("floating_base", "floating_root"))).q, q)


def test_floating_columns_that_are_refused(flying, written):
    t = np.linspace(0, 1, 8)
    table = floating_table(t, turning(t)[0])
    without = {k: x for k, x in table.items() if k != "floating_base.qw"}
    assert "no column 'floating_base.qw' for joint floating_base; add its pose (position in m, unit quaternion)" in refusal(flying, written(csv(without)))
    some = table | {"floating_base.vx": t}
    assert "no column 'floating_base.vy', though others of its group are there; give all of floating_base.vx, floating_base.vy" in refusal(
        flying, written(csv(some))
    )
    long = {k: (x * 1.1 if ".q" in k else x) for k, x in table.items()}
    long["floating_base.qw"][:3] = table["floating_base.qw"][:3]
    for c in ("qx", "qy", "qz"):
        long[f"floating_base.{c}"][:3] = table[f"floating_base.{c}"][:3]
    assert refusal(flying, written(csv(long))).startswith(":5: the quaternion of floating_base has length 1.1; expected a unit quaternion")


def test_columns_of_a_spherical_joint_are_said(robot, written):
    ball = robot(TWO.replace('name="knee" type="revolute"', 'name="s" type="spherical"'))
    lines = lambda head: written(head + "\n" + "0,0,0,0\n1,0,0,0\n")
    assert refusal(ball, lines("time,hip,s,x")).startswith(":1: unknown column 's'; joint s is spherical: give s.qx s.qy s.qz s.qw")
    assert refusal(ball, lines("time,hip,s.v,x")).startswith(":1: unknown column 's.v'; joint s is spherical: give s.wx s.wy s.wz")
    assert refusal(ball, lines("time,hip,s.a,x")).startswith(":1: unknown column 's.a'; joint s is spherical: give s.bx s.by s.bz")
    few = written("time,hip,hip.v,hip.a,s.qx,s.qy,s.qz,s.qw\n" + "".join(f"{k},0,0,0,0,0,0,1\n" for k in range(5)))
    assert refusal(ball, few).endswith("differentiating s needs at least 6; add samples, or give the columns s.wx s.wy s.wz and s.bx s.by s.bz")


def test_rates_of_joints_with_several_coordinates(robot, written):
    """Positions that are polynomials in time; a planar joint's rates are in the child's axes."""
    link = '<link name="{0}"/><joint name="{0}" type="{2}"><parent link="{1}"/><child link="{0}"/><axis2 xyz="0 1 0"/></joint>'
    chain = [link.format(kind, parent, kind) for parent, kind in (("ground", "planar"), ("planar", "cylindrical"), ("cylindrical", "universal"))]
    m = robot(f'<robot name="r"><link name="ground"/>{"".join(chain)}{link.format("translation", "universal", "translation")}</robot>', masses="optional")
    t = np.linspace(0, 1, 9)
    polynomials = [np.polynomial.Polynomial(c) for c in np.random.default_rng(2).normal(size=(m.nq, 5))]
    q, q1, q2 = (np.stack([p.deriv(k)(t) for p in polynomials], axis=1) for k in range(3))
    groups = [columns_of(j) for j in m.joints[: len(m.joint_names)]]
    positions = [c for group in groups for c in group[0]]
    assert positions[:5] == ["planar.x", "planar.y", "planar.angle", "cylindrical.angle", "cylindrical.travel"]
    table = {"time": t, **dict(zip(positions, q.T))}
    motion = read_motion(m, written(csv(table)))
    turned = np.exp(-1j * q[:, 2])
    v, a = (q1[:, 0] + 1j * q1[:, 1]) * turned, (q2[:, 0] + 1j * q2[:, 1]) * turned
    a = a - 1j * q1[:, 2] * v
    q1[:, 0], q1[:, 1], q2[:, 0], q2[:, 1] = v.real, v.imag, a.real, a.imag
    assert motion.v == pytest.approx(q1, abs=1e-9) and motion.a == pytest.approx(q2, abs=1e-7)
    given = read_motion(m, written(csv(table | dict(zip([c for group in groups for c in group[1]], q1.T)))))
    assert np.array_equal(given.v, q1) and not given.contradictions
    wrong = dict(zip(groups[1][1], q1[:, 3:5].T + 5))
    said = read_motion(m, written(csv(table | wrong))).contradictions
    assert len(said) == 1 and said[0].startswith(("cylindrical.angle.v at ", "cylindrical.travel.v at "))
    assert (" m/s, but" in said[0]) == said[0].startswith("cylindrical.travel")


def test_columns_that_could_be_of_two_joints(robot, written):
    chain = lambda first, second: robot(TWO.replace('"hip"', f'"{first}"').replace('"knee"', f'"{second}"'))
    line = "0,0,0\n"
    assert refusal(chain("j", "j.v"), written("time,j,j.v\n" + line)).startswith(
        ":1: column 'j.v' could be the velocity of joint j or the position of joint j.v; rename one"
    )
    assert "could be the position of joint j.a or the acceleration of joint j; rename one" in refusal(chain("j.a", "j"), written("time,j,j.a\n" + line))
    assert refusal(chain("hip", "time"), written("time,hip\n0,0\n")).startswith(":1: column `time` holds the times, and two has a joint 'time' too; rename")


@pytest.mark.parametrize(
    "columns",
    [
        {"hip": [1e308, -1e308] * 4, "knee": range(8)},
        {"hip": range(8), "knee": range(8), "hip.v": [1e308, -1e308] * 4},
        {"time": [k * 1e-320 for k in range(8)], "hip": range(8), "knee": range(8)},
    ],
    ids=["positions", "velocities", "times"],
)
def test_what_can_t_be_differentiated(two, written, columns):
    found = refusal(two, written(csv({"time": range(8)} | columns)))
    assert found.startswith(":2: ") and "hip" in found and "check their units" in found


@pytest.mark.parametrize("n", [5, 6])
def test_six_samples_are_enough(two, n):
    """To be smoothed, to be looked at for jumps, and to say that given rates contradict them."""
    t = 0.1 * np.arange(n)
    q, none = np.column_stack([2 * t, 0 * t]), np.zeros((n, 1))
    given = [[none - 2, none], [none, none]]
    assert [line.split(" at ")[0] for line in complete(two, t, q, given).contradictions] == ["hip.v"] * (n == 6)
    assert list(_jumps(two.joints[:2], Samples(t, q, [[None, None]] * 2), differentiated=True)) == ["hip", "knee"] * (n == 6)
    if n == 6:
        assert complete(two, t, q, given, smooth=4.0).smooth == 4.0
    else:
        with pytest.raises(ksl.MotionError, match="5 samples, but smoothing needs at least 6"):
            complete(two, t, q, given, smooth=4.0)


def test_quaternions_are_of_unit_length_when_smoothed_and_what_is_behind_them_stays(robot):
    """A body that turns by 1 rad/s, with a hinge that stands at 0.7 rad: a low pass halves what turns at its frequency, and a constant is as it was."""
    m = robot(TWO.replace('type="revolute"', 'type="floating"', 1))
    t = np.linspace(0, 2, 101)
    k, rest = m.joint("hip").quaternion, m.joint("knee").q_index
    q = np.zeros((101, m.nq))
    q[:, rest] = 0.7
    q[:, m.joint("hip").q_index + k + 2], q[:, m.joint("hip").q_index + k + 3] = np.sin(t / 2), np.cos(t / 2)
    found = complete(m, t, q, [[None, None]] * 2, smooth=3.0)
    assert rest == k + 4 and found.q[:, rest] == pytest.approx(np.full(101, 0.7), abs=1e-12)
    assert np.linalg.norm(found.q[:, k : k + 4], axis=1) == pytest.approx(np.ones(101), abs=1e-12)


# rates that contradict


def contradictions(two, t, q, v=None, a=None) -> list[str]:
    """Of hip, while knee rests."""
    zero = np.zeros((len(t), 1))
    column = lambda x: None if x is None else np.asarray(x, dtype=float)[:, None]
    return complete(two, t, np.column_stack([q, zero]), [[column(v), column(a)], [zero, zero]]).contradictions


@pytest.mark.parametrize("n", [30, 1000])  # six samples are too few to judge
def test_rates_that_contradict_the_positions_are_noted(two, n):
    t = np.linspace(0, 1, n)
    q, v, a = np.sin(2 * t), 2 * np.cos(2 * t), -4 * np.sin(2 * t)
    assert contradictions(two, t, q, v, a) == contradictions(two, t, q, v) == contradictions(two, t, q, None, a) == []
    (line,) = contradictions(two, t, q, 1.1 * v, 1.1 * a)
    assert line.startswith("hip.v at 0") and "s is 2.2 rad/s, but the position of hip changes at 2 rad/s" in line
    (line,) = contradictions(two, t, q, v, -a)
    assert line.startswith("hip.a at ") and "but the velocity of hip changes at -" in line
    assert len(contradictions(two, t, q, None, a + 1)) == 1, "positions alone are given"
    assert len(contradictions(two, t, q, np.zeros(n), a)) == 2


def test_noise_rounding_and_corners_are_no_contradiction(two):
    rng = np.random.default_rng(5)
    t = np.arange(1000) * 0.004
    zero = np.zeros(1000)
    assert contradictions(two, t, rng.normal(size=1000) * 1e-5, zero, zero) == [], "rest, measured"
    assert contradictions(two, t, np.where(t < 2, 0, 1e-6), zero, zero) == [], "rest, one step of an encoder"
    q, v = np.sin(t), np.cos(t)
    assert contradictions(two, t, np.round(q, 4), v, -q) == [], "four digits"
    assert contradictions(two, t, q + rng.normal(size=1000) * 1e-4, v, -q) == [], "measured"
    a = np.where(t < 1, 2.0, np.where(t < 3, 0.0, -2.0))  # steps of the acceleration, as drives give them
    v = np.minimum(2 * np.minimum(t, 1), np.where(t < 3, 2, 2 - 2 * (t - 3)))
    q = np.where(t < 1, t * t, np.where(t < 3, 2 * t - 1, 5 + 2 * (t - 3) - (t - 3) ** 2))
    assert contradictions(two, t, q, v, a) == [], "trapezoidal velocity"


def test_contradicting_rates_of_a_floating_base(flying):
    t = np.linspace(0, 1, 101)
    q, v, a = turning(t)
    assert complete(flying, t, q, [[v, a]]).contradictions == []
    in_world = v.copy()
    in_world[:, 3:] *= [1, -1, 1]
    (line,) = complete(flying, t, q, [[in_world, derivative(t, in_world)]]).contradictions
    assert line.startswith("floating_base.wy at ") and "rad/s, but the position of floating_base changes at" in line


# external wrenches


def test_external_wrenches(two, written):
    t = np.linspace(0, 1, 8)
    w = read_external(two, written(csv({"time": t, "c.fz": t + 1, "b.tx": t + 2, "c.fx": t + 3})), t)
    assert set(w) == {"b", "c"}
    assert np.array_equal(w["c"], np.stack([t + 3, 0 * t, t + 1, 0 * t, 0 * t, 0 * t], axis=1))
    assert np.array_equal(w["b"][:, 3], t + 2) and not w["b"][:, [0, 1, 2, 4, 5]].any()


def test_links_with_dots_in_their_names(robot, written):
    m = robot('<robot name="r"><link name="hand.left"/></robot>')
    t = np.linspace(0, 1, 8)
    assert np.array_equal(read_external(m, written(csv({"time": t, "hand.left.fy": t})), t)["hand.left"][:, 1], t)


BAD_EXTERNAL = {
    "no time": ({"x": 1.0, "c.fx": 1.0}, ":1: no column `time`; found x, c.fx"),
    "no such link": ({"time": 1.0, "hand.fx": 1.0}, ":1: unknown column 'hand.fx'; expected LINK.fx … LINK.tz with a link of a, b, c"),
    "no such component": ({"time": 1.0, "c.fw": 1.0}, ":1: unknown column 'c.fw'"),
    "not finite": ({"time": 1.0, "c.fx": np.nan}, ":2: column 'c.fx' is not a number or missing"),
    "other times": ({"time": 1.1, "c.fx": 1.0}, ": its times are not those of the motion; give one line for each sample"),
}


@pytest.mark.parametrize("what", BAD_EXTERNAL)
def test_external_wrenches_that_are_refused(two, written, what):
    columns, sentence = BAD_EXTERNAL[what]
    t = np.linspace(0, 1, 8)
    table = {name: (t * scale if name in ("time", "t") else t + scale) for name, scale in columns.items()}
    assert sentence in refusal(two, written(csv(table)), read_external, t)


def test_external_wrenches_at_fewer_samples(two, written):
    t = np.linspace(0, 1, 8)
    assert "its times are not those of the motion" in refusal(two, written(csv({"time": t[:-1], "c.fx": t[:-1]})), read_external, t)


def test_motion_is_a_plain_record():
    t = np.zeros(1)
    assert Motion(t, t, t, t).differentiated == []
