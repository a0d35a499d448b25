"""Generated C, compiled and called: for tests."""

import ctypes
import subprocess
from pathlib import Path

import numpy as np

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
