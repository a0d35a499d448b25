"""Each of the calls that are used most has an example in its docstring, indented as code, and it runs as it stands."""

import inspect
import re
import shutil
import textwrap
from pathlib import Path

import numpy as np
import pytest

import ksl

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"

MAIN = (
    ksl.load, ksl.load_string, ksl.Builder, ksl.compute_loads, ksl.hold, ksl.free_bodies, ksl.size, ksl.sweep, ksl.frequencies, ksl.check, ksl.read_motion, ksl.Run.write,
    ksl.Pose.from_rpy, ksl.Pose.from_quaternion,
    *(getattr(ksl.Model, name) for name in (
        "inverse_dynamics", "reactions", "effort_parts", "bias", "gravity_torque", "forward_dynamics", "hybrid_dynamics", "mass_matrix", "coriolis_matrix",
        "frame_pose", "frame_poses", "frame_velocity", "frame_acceleration", "jacobian", "energy", "center_of_mass", "inverse_dynamics_derivatives",
        "inverse_dynamics_regressor", "integrate", "difference", "inverse_kinematics", "wrench_table", "section_wrench", "with_physics", "with_payload",
        "with_frame", "with_frozen_joints", "random", "free_bodies", "modes", "compliance", "deflection", "equilibrium", "linearise",
    )),
)  # fmt: skip
SHAPE = re.compile(r"# \(([\w ,·]+)\)")
"""What a comment beside a result says of its shape, (6,) for instance."""


@pytest.fixture(scope="module")
def names(tmp_path_factory):
    """What examples are given: a UR5 as m, numbers of its six joints, a motion."""
    folder = tmp_path_factory.mktemp("calls")
    shutil.copy(EXAMPLES / "robots/ur5.urdf", folder / "robot.urdf")
    shutil.copy(EXAMPLES / "motions/ur5_pick.csv", folder / "motion.csv")
    rng, time = np.random.default_rng(0), np.linspace(0, 1, 20)
    q, v, a, tau = rng.uniform(-1, 1, (4, 6))
    given = {"ksl": ksl, "np": np, "m": ksl.load(folder / "robot.urdf"), "q": q, "v": v, "a": a, "tau": tau, "time": time}
    return folder, given | {"q_over_time": np.sin(np.outer(time, np.arange(6)))}


@pytest.mark.usefixtures("sweeps_here")
@pytest.mark.parametrize("call", MAIN, ids=lambda call: call.__qualname__)
def test_example(call, names, monkeypatch, capsys):
    folder, given = names
    monkeypatch.chdir(folder)
    blocks = re.findall(r"\n\n((?:    .*(?:\n|\Z))+)", inspect.getdoc(call))
    assert blocks, "an example: lines of Python, indented below an empty line, at the end of the docstring"
    for block in blocks:
        found = dict(given)
        exec(compile(textwrap.dedent(block), call.__qualname__, "exec"), found)
        for line in block.splitlines():
            name, says = re.match(r"\s*(\w+) = ", line), SHAPE.search(line)
            if name and says:
                shape = tuple(
                    {"joints": len(found["m"].joints), "samples": len(found["motion"].time) if "motion" in found else 0}.get(x.strip()) or int(x)
                    for x in says[1].split(",")
                    if x.strip()
                )
                assert np.shape(found[name[1]]) == shape, line
