"""Simulated motions against values to 40 digits: torque-free bodies by elliptic functions, heavy tops by quadrature, double pendulums by Taylor
series.  Limits are what an integrator of order 8 with a local error of 1e-13 can be asked for."""

import json
from pathlib import Path

import numpy as np
import pytest

import ksl

FOLDER = Path(__file__).parent / "simulation"
TOPS = [
    pytest.param(case, id=f"{name}-{k}")
    for name in ("free_top", "heavy_top")
    for k, case in enumerate(json.loads((FOLDER / f"{name}.json").read_text())["cases"])
    if "states" in case
]
PENDULUMS = json.loads((FOLDER / "double_pendulum.json").read_text())["cases"]


def top(case):
    is_free = "inertia" in case
    inertia = case["inertia"] if is_free else case["inertia_about_com"]
    b = ksl.Builder("top", gravity=[0, 0, -case.get("g", 0.0)]).add_link("world")
    b.add_link("body", mass=case.get("mass", 1.0), center_of_mass=case.get("com", [0, 0, 0]), inertia=np.diag(inertia))
    return b.add_joint("joint", "floating" if is_free else "spherical", "world", "body").build()


def pendulum(case):
    b = ksl.Builder("pendulum", gravity=[0, 0, -case["g"]]).add_link("world")
    for k, parent in enumerate(["world", "rod0"]):
        pose = np.eye(4)
        pose[2, 3] = -case["length_1"] * k
        b.add_link(f"rod{k}", mass=case["m"][k], center_of_mass=[0, 0, -case["com"][k]], inertia=np.diag([case["inertia_about_com"][k]] * 3))
        b.add_joint(f"j{k}", "continuous", parent, f"rod{k}", pose=pose, axis=[0, -1, 0])
    return b.build()


@pytest.mark.parametrize("case", TOPS)
def test_tops_turn_as_elliptic_functions_say(case):
    m, at = top(case), [0.0, 0.0, 0.0] if "inertia" in case else []
    times = [0.0, *(state["t"] for state in case["states"])]
    run = m.simulate([*at, *case["q0"]], [*at, *case["omega0"]], times, rtol=1e-13, atol=1e-13)
    assert run.complete
    scale = 1.0 if at else max(1.0, np.abs(case["omega0"]).max())
    for state, q, v in zip(case["states"], run.q[1:, len(at) :], run.v[1:, len(at) :], strict=True):
        limit = (1e-6 if case["k2"] > 0.999 else 1e-9) if at else 1e-8 if state["t"] < 3 else 1e-7
        assert min(np.abs(q - state["q"]).max(), np.abs(q + state["q"]).max()) < limit
        assert np.abs(v - state["omega"]).max() < limit * scale


@pytest.mark.parametrize("case", PENDULUMS.values(), ids=PENDULUMS)
def test_double_pendulums(case):
    angle, rate = case["start"]["angle_from_vertical"], case["start"]["rate"]
    times = [0.0, *(state["t"] for state in case["states"])]
    run = pendulum(case).simulate([angle[0], angle[1] - angle[0]], [rate[0], rate[1] - rate[0]], times, rtol=1e-13, atol=1e-13)
    for state, q, v in zip(case["states"], run.q[1:], run.v[1:], strict=True):
        limit = 1e-8 if state["t"] < 6 else 1e-6
        assert np.abs(q - state["relative_joint_angles"]).max() < limit and np.abs(v - state["relative_joint_rates"]).max() < limit
