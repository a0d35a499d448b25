"""Generated C, compiled and called: for tests."""

import ctypes
import subprocess
from pathlib import Path

import numpy as np

import ksl
from ksl.generation.arguments import arguments_given
from ksl.generation.requests import functions_of
from ksl.generation.rows import ROWS
from ksl.generation.self_test import SelfTest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples/robots"
FLAGS = "-std=c99 -O1 -ffp-contract=off -Wall -Wextra -Wconversion -Wdouble-promotion -Werror -pedantic".split()


def run(*command, cwd):
    r = subprocess.run([str(x) for x in command], cwd=cwd, capture_output=True, text=True)
    assert r.returncode == 0, f"{command}: {r.stdout}{r.stderr}"
    return r.stdout


def compiled(folder, name, compiler="gcc"):
    run(compiler, *FLAGS, "-fPIC", "-shared", f"{name}.c", "-o", "code.so", "-lm", cwd=folder)
    return ctypes.CDLL(str(folder / "code.so"))


def call(f, inputs, sizes, dtype=np.float64):
    out = [np.full(n, np.nan, dtype) for n in sizes]
    assert all(x.dtype == dtype and x.flags.c_contiguous for x in inputs)
    f(*(ctypes.c_void_p(x.ctypes.data) for x in (*inputs, *out)))
    return out


def rows_of(m, links, joints, refused=()):
    """Every algorithm as it is asked for, of a link and another, and of a joint; none of `refused`."""
    behind = {
        "link": links[0],
        "frame": links[0],
        "relative": "+".join(links),
        "links": links[0],
        "frames": links[0],
        "reactions": joints[0],
        "joints": joints[0],
    }
    named = {row: f"{row}:{behind[how.request]}" if how.request else row for row, how in ROWS.items() if row not in refused}
    return list((named | {row: f"{row}:{joints[0]}" for row in ("hybrid_dynamics",) if row in named}).values())


def check_bits(m, asked, folder, scalar="double", arguments=(), states=6, compiler="gcc", bound=0.0):
    """The functions have the engine's bits, in states of the self-test and others; or they agree to a bound.  Returns how many results weren't NaN."""
    ksl.generate(m, asked, folder, name="p", scalar=scalar, arguments=arguments)
    code, served, dtype = compiled(folder, "p", compiler), 0, np.float64 if scalar == "double" else np.float32
    for f in functions_of(m, asked, arguments_given(m, arguments), scalar == "float", "refuse"):
        test = SelfTest(m, "p", scalar, 0, [f], "")
        written = np.split(f.recording.outputs >= 0, np.cumsum(f.recording.sizes())[:-1])
        for k in range(states):
            given = [np.ascontiguousarray(x) for x in test.state_of(f, k)]
            expected = [np.ravel(x)[to] for x, to in zip(f.results(m, given), written)]
            for x, y, to in zip(call(getattr(code, f"p_{f.name}"), given, [max(1, n) for n in f.recording.sizes()], dtype), expected, written):
                if m.loops and np.isnan(x).any():  # where the engine takes other pivots; efforts of joints without a drive stay 0
                    assert (np.isnan(x) | (x == 0)).all(), (f.name, k)
                    continue
                x = x[: to.size][to]
                served += x.size
                worst = np.abs(np.asarray(x, float) - y).max(initial=0.0)
                assert np.array_equal(x, y) or worst <= bound * np.abs(y).max(), (f.name, k, worst)
    return served


FOLLOWED = """<robot name="gripper"><link name="palm"/>
{links}
<joint name="lift" type="prismatic"><parent link="palm"/><child link="l0"/><axis xyz="0 0 1"/><limit effort="1" velocity="1" lower="-1" upper="1"/></joint>
<joint name="thumb" type="revolute"><parent link="l0"/><child link="l1"/><origin xyz="0.1 0 0.2"/><axis xyz="0 1 0"/><limit effort="1" velocity="1" lower="-1" upper="1"/></joint>
<joint name="finger" type="revolute"><parent link="l0"/><child link="l2"/><origin xyz="-0.1 0 0.2"/><axis xyz="0 1 0"/><mimic joint="thumb" multiplier="-0.7" offset="0.2"/>
<limit effort="1" velocity="1" lower="-1" upper="1"/></joint></robot>""".format(
    links="".join(
        f'<link name="l{k}"><inertial><origin xyz="0.01 0.02 0.1"/><mass value="{k + 1}"/><inertia ixx="0.1" iyy="0.2" izz="0.15" ixy="0.01" ixz="0" iyz="0"/></inertial></link>'
        for k in range(3)
    )
)
"""Mimic joints."""


def on_struts(**wrist):
    """An arm: a strut with a stop, a spring of no length, and a cylinder between two moving links."""
    b = ksl.Builder("struts").add_link("base")
    for k, name in enumerate(("lower", "upper", "hand")):
        b.add_link(name, 2.0 - 0.5 * k, (0.2, 0.02, -0.01), np.diag([0.02, 0.05, 0.06]))
    b.add_joint("shoulder", "revolute", "base", "lower", ksl.Pose.from_rpy((0, 0, 0.4), (0.1, 0, 0)), axis=(0, 1, 0), damping=0.3, limits=(-2, 2))
    b.add_joint("elbow", "revolute", "lower", "upper", ksl.Pose.from_rpy((0.4, 0, 0), (0, 0.2, 0.3)), axis=(0, 1, 0), limits=(-2, 2))
    b.add_joint("wrist", "revolute", "upper", "hand", ksl.Pose.from_rpy((0.3, 0, 0)), axis=(1, 0, 0), **wrist)
    b.add_force_element(
        "strut",
        "base",
        (0.1, 0, 0),
        "lower",
        (0.25, 0.01, 0.02),
        stiffness=900.0,
        free_length=0.4,
        damping=15.0,
        preload=-20.0,
        limits=(0.3, 0.42),
        stop_stiffness=5e3,
    )
    b.add_force_element("balance", "base", (0, 0, 0.9), "lower", (0.3, 0, 0), stiffness=120.0)
    return b.add_force_element("cylinder", "lower", (0.1, 0, 0.1), "hand", (0.1, 0.05, 0), preload=80.0, damping=30.0)


def spatial_four_bar(drives=("drive",)):
    """A closed mechanism all of whose reactions are determined."""
    b = ksl.Builder("spatial_four_bar").add_link("base")
    for name in ("crank", "rod", "rocker"):
        b.add_link(name, 1.0, (0.1, 0, 0.02), np.diag([0.02, 0.03, 0.04]))
    b.add_joint("drive", "revolute", "base", "crank", axis=(0, 0, 1))
    b.add_joint("elbow", "universal", "crank", "rod", ksl.Pose.from_rpy((0.2, 0, 0)), axis=(0, 0, 1), axis2=(0, 1, 0))
    b.add_joint("hinge", "revolute", "base", "rocker", ksl.Pose.from_rpy((0.5, 0, 0)), axis=(0, 1, 0))
    b.add_loop("ball", "spherical", "rod", "rocker", ksl.Pose.from_rpy((0.3, 0, 0.3)), ksl.Pose.from_rpy((0, 0, 0.3)))
    return b.build(drives=list(drives))
