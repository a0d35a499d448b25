"""C of the maps in both directions: the numbers of the Python maps, within the error that the header states."""

import ctypes
import re
import shutil
import subprocess
from functools import cache

import ksl
import numpy as np
import pytest
from ksl.drivetrain.elimination import pivot_order
from ksl.drivetrain.loop_rows import distances, rows_of_loops
from numpy.testing import assert_allclose

from examples import JOINTS, ROBOTS, leg

pytestmark = [
    pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning"),  # spherical is no kind of URDF's
    pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc"),
]


@cache
def code(a):
    return a.c_code("ankle")


def built(a, folder):
    """The functions of both directions, compiled without a warning, and the errors that the header states."""
    files = code(a)
    for name, text in files.items():
        (folder / name).write_text(text)
    sources = [folder / name for name in files if name.endswith(".c")]
    flags = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off", "-shared", "-fPIC"]
    done = subprocess.run(["gcc", *flags, "-o", folder / "maps.so", *sources, "-lm"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    library, n = ctypes.CDLL(str(folder / "maps.so")), len(a.joints)
    numbers = ctypes.POINTER(ctypes.c_double)

    def called(name, x):
        x, y, J = np.array(x), np.zeros(n), np.zeros((n, n))
        ended = getattr(library, name)(*(array.ctypes.data_as(numbers) for array in (x, y, J)))
        return ended, y, J

    return called, [float(x) for x in re.findall(r"within (\S+) of the exact", files["ankle_maps.h"])]


def held_by_the_python_maps(a, folder):
    called, errors = built(a, folder)
    q = a.usable(40, seed=11)  # others than those of the fit
    motors, W = a.motors_of(q), a.motor_jacobian(q)
    for x, theta, J in zip(q, motors, W):
        ended, y, jacobian = called("ankle_motors_of", x)
        assert ended == 1
        assert_allclose(y, theta, atol=max(10 * errors[0], 1e-11))
        assert_allclose(jacobian, J, rtol=1e-7, atol=1e-7)
        ended, y, jacobian = called("ankle_joints_of", theta)
        assert_allclose(y, x, atol=max(10 * errors[1], 1e-11))
        assert_allclose(jacobian @ J, np.eye(len(x)), atol=1e-7)
    assert max(errors) < 1e-8


@pytest.mark.parametrize("name", JOINTS)
def test_the_maps_of_the_examples(name, tmp_path):
    held_by_the_python_maps(leg(name), tmp_path)


@cache
def otherwise(kind):
    """The ankle with a universal joint, or three hinges, at the upper end of each rod, which then stay in the equations."""
    text = (ROBOTS / "two_rod_ankle.urdf").read_text()
    for side in ("left", "right"):
        top = re.search(rf'<joint name="ball_{side}_top".*?</joint>', text, re.DOTALL)[0]
        if kind == "universal":
            text = text.replace(top, top.replace('"spherical"', '"universal"').replace("</joint>", '<axis xyz="0 1 0"/><axis2 xyz="1 0 0"/></joint>'))
        else:
            links = [f"crank_{side}", f"{side}_1", f"{side}_2", f"rod_{side}"]
            places = [(f"{side}_{k}", links[k], links[k + 1], "-0.05 0 0" if k == 0 else "0 0 0", axis) for k, axis in enumerate(("1 0 0", "0 1 0", "0 0 1"))]
            hinges = "".join(
                f'<joint name="hinge_{n}" type="continuous"><parent link="{p}"/><child link="{c}"/><origin xyz="{x}"/><axis xyz="{axis}"/></joint>'
                for n, p, c, x, axis in places
            )
            text = text.replace(top, f'<link name="{side}_1"/><link name="{side}_2"/>{hinges}')
    return ksl.load_string(text).actuation(JOINTS["two_rod_ankle"])


@pytest.mark.parametrize("kind", ["universal", "three hinges"])
def test_rods_that_stay_in_the_equations(kind, tmp_path):
    held_by_the_python_maps(otherwise(kind), tmp_path)


HINGES = {"universal": 4, "cylindrical": 4, "planar": 3, "translation": 3}
"""Equations of loops that aren't five: a chain has one coordinate more."""


def spatial(kind, axis=(0, 1, 0), pitch=0.0):
    """Crank, rod and rocker in space, which end at a loop of this kind; "pin": a weld behind a hinge of the tree."""
    count = HINGES.get(kind, 5)
    b = ksl.Builder("spatial").add_link("ground")
    for name in ("crank", "rod", "tip", "rocker"):
        b.add_link(name, mass=0.3, center_of_mass=(0, 0.01, 0.02), inertia=np.eye(3) * 1e-3)
    b.add_joint("A", "continuous", "ground", "crank", axis=(0, 0, 1))
    if count > 3:
        b.add_joint("ball", "spherical", "crank", "rod", xyz=(0, 0.1, 0))
    else:
        b.add_joint("cross", "universal", "crank", "rod", xyz=(0, 0.1, 0), axis=(0, 0.8, 0.6), axis2=(1, 0, 0))
    b.add_joint("C", "continuous" if count > 4 else "fixed", "rod", "tip", xyz=(0.05, 0.1, 0.2), **({"axis": (1, 0, 0)} if count > 4 else {}))
    b.add_joint("E", "revolute", "ground", "rocker", xyz=(0.1, 0, 0.4), axis=(0, 0, 1), limits=(-0.4, 0.4))
    end, ball = (np.vstack([np.column_stack([np.eye(3), x]), [0, 0, 0, 1]]) for x in ((0.05, 0.1, 0.2), (0, 0.3, 0)))
    if kind == "pin":
        b.add_link("pin").add_joint("P", "continuous", "rocker", "pin", pose=ball, axis=axis)
        return b.add_loop("D", "fixed", "tip", "pin", end).build(drives=["A"])
    more = {"axis2": (1, 0, 0)} if kind == "universal" else {"pitch": pitch} if kind == "helical" else {}
    return b.add_loop("D", kind, "tip", "rocker", end, ball, axis=None if kind == "translation" else axis, **more).build(drives=["A"])


KINDS = pytest.mark.parametrize(
    "arguments",
    [
        ("revolute",),
        ("pin",),
        ("helical", (0, 1, 0), 0.03),
        ("helical", (0, 1, 0), 0.0),
        ("prismatic", (0.6, 0.64, 0.48)),
        ("universal",),
        ("cylindrical", (0.6, 0.64, 0.48)),
        ("planar", (0.6, 0, 0.8)),
        ("translation",),
    ],
    ids=lambda x: x[0] + ("" if x[2:] != (0.0,) else " without pitch"),
)


@KINDS
def test_forces_in_loops_of_every_kind(arguments):
    """Those of the engine's reactions: of a screw also along its axis, where its equation is one of a force and a moment."""
    arguments = (*arguments[:2], 0.7) if arguments[2:] == (0.03,) else arguments
    a = spatial(*arguments).actuation(["E"])
    q = a.usable(3, seed=2)
    v, acc = np.random.default_rng(2).normal(size=(2, *q.shape))
    wanted = a.model.reactions(*a.state(q, v, acc), joints=["D"])[..., :3]
    assert_allclose(a.loop_forces(q, v, acc), np.linalg.norm(wanted, axis=2), rtol=1e-9)


@KINDS
def test_loops_of_every_kind(arguments, tmp_path):
    held_by_the_python_maps(spatial(*arguments).actuation(["E"]), tmp_path)


def rows_and_errors(a, Q):
    """Rows of the loops of a map, with rods as distances, and what they are in numbers at a position of its tree: errors, and their Jacobian."""
    tree = a.equations.tree
    rods, balls, _ = distances(a.equations)
    rows = rods + rows_of_loops(a.equations, a.start, [a.model.joint(name).child for name in balls])
    links = {link for row in rows for link, _ in row.sides}
    poses, jacobians = ({link: f(Q, link) for link in links} for f in (tree.frame_pose, tree.jacobian))
    found = [row.numbers(poses, jacobians) for row in rows]
    return rows, np.array([error for error, _ in found]), np.array([row for _, row in found])


def rows_are_derivatives(a):
    """Errors are zero where loops are closed, and there differences of them are the rows, along whatever all joints do; rows are as many, and independent, as the loops'."""
    tree, G = a.equations.tree, a.equations.jacobian
    for Q in a.state(a.usable(3, seed=7))[0]:
        rows, errors, J = rows_and_errors(a, Q)
        assert_allclose(errors, 0, atol=1e-12)
        h, V = 1e-6, np.eye(tree.nv)
        ahead, behind = (np.array([rows_and_errors(a, tree.integrate(Q, s * h * v))[1] for v in V]) for s in (1, -1))
        assert_allclose(J, (ahead - behind).T / (2 * h), atol=1e-7)
        assert np.linalg.matrix_rank(J, 1e-7) == len(rows)
        motions = a.equations.motions(Q[None], a.equations.part.of_joints)[0]
        assert_allclose(J @ motions, 0, atol=1e-10)
        if not a.equations.rods:
            assert len(rows) == np.linalg.matrix_rank(G(Q[None])[0], 1e-9)


@KINDS
def test_rows_of_loops_are_derivatives(arguments):
    rows_are_derivatives(spatial(*arguments).actuation(["E"]))


@pytest.mark.parametrize("name", JOINTS)
def test_rows_of_the_examples_are_derivatives(name):
    rows_are_derivatives(leg(name))
    assert len(distances(leg(name).equations)[0]) == len(leg(name).equations.rods), "each of their rods has balls at both ends"


def test_pivots_are_large_in_their_rows_and_keep_their_signs():
    """The small row is no reason, nor its scale; (0, 1) has both signs over the range, (1, 0) has one."""
    A = np.array([[[0.1, 1.0], [2.0, 0.1]], [[0.1, -1.0], [3.0, 0.1]]])
    for scale in (1.0, 1e-3, 1e3):
        order = pivot_order(A * np.array([scale, 1.0])[:, None], A[0])
        assert order.places == ((0, 1), (1, 0)) and order.least == (0.0, pytest.approx(2.0, rel=0.02))


def test_a_rod_between_balls_is_one_equation():
    """Its tree has no coordinates for it: those of the joints and motors are left."""
    assert "double q[4]" in code(leg("two_rod_ankle"))["ankle_maps.c"]
    assert "double q[10]" in code(otherwise("three hinges"))["ankle_maps.c"]


def test_positions_that_are_out_of_the_range(tmp_path):
    called, _ = built(leg("two_rod_ankle"), tmp_path)
    assert [called("ankle_motors_of", x)[0] for x in ([0.0, 0.0], [0.0, 1.4], [0.0, 9.0], [np.nan, 0.0])] == [1, 0, 0, 0]


def test_a_joint_that_is_its_own_motor(tmp_path):
    called, _ = built(leg("four_bar_knee").model.actuation(["hip_pitch"]), tmp_path)
    assert [x.tolist() for x in called("ankle_motors_of", [0.3])[1:]] == [[0.3], [[1.0]]]


def test_a_name_that_is_none_in_c():
    with pytest.raises(ValueError, match="2legs"):
        leg("two_rod_ankle").c_code("2legs")


def test_names_of_links_are_free():
    """Two that are the same in C, and characters of requests: no text has any of them."""
    text = (ROBOTS / "two_rod_ankle.urdf").read_text()
    named = text.replace("crank_left", "crank+:.l").replace("crank_right", "crank+:-l").replace("shank", " shank ")
    assert ksl.load_string(named).actuation(JOINTS["two_rod_ankle"]).c_code("ankle") == code(leg("two_rod_ankle"))
