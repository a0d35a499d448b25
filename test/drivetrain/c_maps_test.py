"""C of the maps in both directions: the numbers of the Python maps, within the error that the header states."""

import ctypes
import re
import shutil
import subprocess

import ksl
import numpy as np
import pytest
from numpy.testing import assert_allclose

from examples import JOINTS, ROBOTS, leg

pytestmark = [
    pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning"),  # spherical is no kind of URDF's
    pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc"),
]


def built(a, folder):
    """The functions of both directions, compiled without a warning, and the errors that the header states."""
    files = a.c_code("ankle")
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


@pytest.mark.parametrize("name", [name for name in JOINTS if name != "differential_wrist"])
def test_the_maps_of_the_examples(name, tmp_path):
    held_by_the_python_maps(leg(name), tmp_path)


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


def spatial(kind):
    """Crank, rod and rocker in space; the rod's end is hinged to the rocker by the loop itself, or by a hinge of the tree, and the loop welds it."""
    b = ksl.Builder("spatial").add_link("ground")
    for name in ("crank", "rod", "tip", "rocker"):
        b.add_link(name, mass=0.3, center_of_mass=(0, 0.01, 0.02), inertia=np.eye(3) * 1e-3)
    b.add_joint("A", "continuous", "ground", "crank", axis=(0, 0, 1)).add_joint("ball", "spherical", "crank", "rod", xyz=(0, 0.1, 0))
    b.add_joint("C", "continuous", "rod", "tip", xyz=(0.05, 0.1, 0.2), axis=(1, 0, 0))
    b.add_joint("E", "revolute", "ground", "rocker", xyz=(0.1, 0, 0.4), axis=(0, 0, 1), limits=(-0.4, 0.4))
    end, ball = (np.vstack([np.column_stack([np.eye(3), x]), [0, 0, 0, 1]]) for x in ((0.05, 0.1, 0.2), (0, 0.3, 0)))
    if kind == "revolute":
        return b.add_loop("D", kind, "tip", "rocker", end, ball, axis=(0, 1, 0)).build(drives=["A"])
    b.add_link("pin").add_joint("P", "continuous", "rocker", "pin", pose=ball, axis=(0, 1, 0))
    return b.add_loop("D", kind, "tip", "pin", end).build(drives=["A"])


@pytest.mark.parametrize("kind", ["revolute", "fixed"])
def test_loops_that_hold_directions(kind, tmp_path):
    held_by_the_python_maps(spatial(kind).actuation(["E"]), tmp_path)


def test_a_rod_between_balls_is_one_equation():
    assert "#define ROWS 2\n" in leg("two_rod_ankle").c_code()["leg_maps.c"]
    assert "#define ROWS 8\n" in otherwise("three hinges").c_code()["leg_maps.c"]


def test_a_joint_that_is_its_own_motor(tmp_path):
    called, _ = built(leg("four_bar_knee").model.actuation(["hip_pitch"]), tmp_path)
    assert [x.tolist() for x in called("ankle_motors_of", [0.3])[1:]] == [[0.3], [[1.0]]]


def test_what_has_no_code():
    with pytest.raises(ValueError, match="loop joint screw is helical, and C of maps is made of loops that are spherical, revolute"):
        leg("differential_wrist").c_code()
    with pytest.raises(ValueError, match="2legs"):
        leg("two_rod_ankle").c_code("2legs")
