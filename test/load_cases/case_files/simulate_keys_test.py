"""Cases that are simulated: their keys and defaults, how many samples they have, and what is said of a run."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hinged_rods import ROD
from ksl.base.errors import CaseError, MotionError
from ksl.load_cases.case_files.simulate_keys import simulated_of
from ksl.load_cases.case_files.simulated import Simulated, _notes, samples_of, simulated_motion
from ksl.load_cases.case_files.wrenches_over_time import WrenchOverTime
from ksl.motions.motion import Motion


@pytest.mark.parametrize(
    ("how", "samples"), [({"until": 1.0}, 251), ({"until": 1.0, "rate": 10.0}, 11), ({"until": 3.0, "start": 2.0}, 251), ({"until": 1e-3}, 2)]
)
def test_samples_of_simulations(how, samples):
    assert samples_of(Simulated(**how), None) == samples
    followed = Motion(np.array([1.0, 2.0]), *np.zeros((3, 2, 1)))
    assert samples_of(Simulated(until=9_999_999 / 250), None) == 10_000_000
    assert samples_of(Simulated(), followed) == 251 and samples_of(Simulated(start=1.5), followed) == 126
    for wrong, said in (
        ({"until": 0.0}, "until 0 s is not after"),
        ({"until": 1.0, "rate": 0.0}, "rate 0; expected"),
        ({"until": 40000.0}, "10,000,001 samples"),
        ({}, "no end"),
    ):
        with pytest.raises(MotionError, match=said):
            samples_of(Simulated(**wrong), None)


def test_a_simulation_under_a_wrench_and_its_error(robot):
    m = robot(ROD)
    moment = WrenchOverTime("rod", np.zeros(1), np.array([[0.0, 0, 0, 0, 0, 0.5]]), "hold", "link", (0, 0, 0))
    how = Simulated(start=1.0, until=3.0, pose={"pin": 0.25}, rate=50.0)
    motion, words = simulated_motion(m, how, None, [moment])
    assert motion.q[:, 0] == pytest.approx(0.25 + (motion.time - 1) ** 2 / 2) and words == "simulated without drives", "0.5 N m turn 0.5 kg m²"
    coarse = simulated_motion(m, replace(how, method="rk4", step=0.02), None, [moment])[0]
    assert coarse.resolution[0] < 1e-11 < 1e-9 * 50 < motion.resolution[0], "dop853 alone controls its error"
    with pytest.raises(MotionError, match="axes 'world' turn with the simulated motion"):
        simulated_motion(m, how, None, [replace(moment, axes="world")])


@pytest.mark.parametrize(("events", "more"), [(12, ""), (13, " and 1 more")])
def test_what_is_said_of_a_simulation(events, more):
    """Losses and changes are the largest magnitudes; twelve events are named."""
    happened = [SimpleNamespace(what="brakes", joint="", time=0.0), *(SimpleNamespace(what="sticks", joint="pin", time=k / 8) for k in range(1, events))]
    drift = SimpleNamespace(energy=np.array([0.0, -3e-7, 1e-7]), closure=np.array([0.0, 2e-9, np.nan]))
    run = SimpleNamespace(drift=drift, energy=np.array([5.0, 2.0, 6.0]), steps=7, events=happened)
    said = _notes(run, Simulated())
    assert said[0] == "7 steps of dop853; energy lost by integration 3e-07 J, where energy changed by 3 J" and said[1].startswith(
        "loops opened by 2e-09 m at most"
    )
    assert said[2] == "events: brakes engage at 0 s; " + "; ".join(f"sticks of pin at {k / 8:.6g} s" for k in range(1, 12)) + more and len(said) == 3


def test_keys_of_a_simulation():
    """Each of them, alone but for what it needs, and with all others, and what is taken for those that are not there."""
    given = {
        "until": 2, "from": 0.5, "pose": {"pin": 1}, "velocity": {"pin": 3}, "controller": "pd", "stiffness": 7, "damping": {"pin": 2}, "brake_at": 1, "brake": {"pin": 9}, "friction": 0.1,
        "restitution": 0.5, "rate": 100, "method": "rk4", "step": 0.01, "rtol": 1e-6, "atol": 1e-7,
    }  # fmt: skip
    names = {"start" if key == "from" else key: x for key, x in given.items()}
    assert simulated_of("x", given) == Simulated(**names) and simulated_of("x", {}) == Simulated()
    needs = {"controller": {"damping": 1}, "stiffness": {"controller": "computed torque"}, "damping": {"controller": "gravity"}, "brake": {"brake_at": 3}}
    for (key, x), name in zip(given.items(), names, strict=True):
        others = needs.get(key, {})
        assert simulated_of("x", {key: x, **others}) == Simulated(**{name: x, **others})
    usual = Simulated()
    assert (usual.controller, usual.stiffness, usual.damping, usual.rate, usual.method, usual.rtol, usual.atol) == (
        "none",
        0.0,
        0.0,
        250.0,
        "dop853",
        1e-9,
        1e-9,
    ), "docs/cases.md"
    for wrong in ({"pose": 3}, {"velocity": 3.0}, {"rate": True}, {"rate": np.inf}, {"stiffness": {"pin": "x"}}, {"method": 4}, {"until": "1"}, 3):
        with pytest.raises(CaseError, match="^x"):
            simulated_of("x", wrong)
