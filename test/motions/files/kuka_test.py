"""Logs of KUKA's controllers as text: variables of KRL and of RSI, in degrees; by the names that robot files of KUKA have."""

import numpy as np
import pytest

import ksl

INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
KINDS = {"rail": "prismatic", None: "continuous"}
POSITIONS = 30 * np.sin(0.012 * np.arange(50)[:, None] * np.linspace(0.5, 1, 7))
"""Degrees, every 12 ms."""


@pytest.fixture
def arm(robot):
    def make(names):
        joints = "".join(
            f'<link name="l{k + 1}">{INERTIAL}</link><joint name="{name}" type="{KINDS.get(name, KINDS[None])}">'
            f'<parent link="l{k}"/><child link="l{k + 1}"/><axis xyz="0 0 1"/><limit lower="-9" upper="9" effort="9" velocity="9"/></joint>'
            for k, name in enumerate(names)
        )
        return robot(f'<robot name="arm"><link name="l0"/>{joints}</robot>')

    return make


def log(variable, axes=6, clock="IPOC", separator="\t", decimal=".", more=()):
    """As a program that reads the variables writes it, with others beside them."""
    start = {"IPOC": 4_208_163_000, "ms": 0}.get(clock, 0)
    names = [clock, *(f"{variable}A{i + 1}" for i in range(axes)), *more]
    rows = [[str(start + 12 * k), *(f"{x:.9f}" for x in q[:axes]), *["0.5"] * len(more)] for k, q in enumerate(POSITIONS)]
    return "\n".join(separator.join(row).replace(".", decimal) if row is not names else separator.join(row) for row in [names, *rows]) + "\n"


@pytest.mark.parametrize(
    "names", [[f"joint_a{i}" for i in range(1, 7)], [f"lbr_A{i}_joint" for i in range(1, 7)], [f"kr_joint_{i}" for i in range(1, 7)], list("uvwxyz")]
)
@pytest.mark.parametrize("variable, which", [("$AXIS_ACT_MEAS.", "measured"), ("$AXIS_ACT_", "commanded"), ("AIPos.", "measured"), ("ASPos_", "commanded")])
def test_positions_in_degrees(arm, written, names, variable, which):
    motion = ksl.read_motion(arm(names), written(log(variable, more=["$TORQUE_AXIS_ACT[1]", "RIst.X"])))
    np.testing.assert_allclose(motion.q, np.radians(POSITIONS[:, :6]), atol=1e-10)
    np.testing.assert_allclose(motion.time, 0.012 * np.arange(50), atol=1e-12)
    notes = "\n".join(motion.source.notes)
    assert (
        f"{variable}A1 to {variable}A6 of KUKA, {which}, are those of {names[0]}, " in notes and "directions are taken to be those of the robot's file" in notes
    )
    assert "times are counted from the first sample, where IPOC is 4208163000" in notes
    assert "not used: $TORQUE_AXIS_ACT[1], RIst.X" in notes and motion.source.format.endswith("of KUKA")


def test_traces_whose_first_column_is_ms_as_a_german_computer_writes_them(arm, written):
    text = log("$AXIS_ACT_MEAS ", axes=7, clock="[ms]", separator=";", decimal=",")
    motion = ksl.read_motion(arm([f"joint_a{i}" for i in range(1, 8)]), written(text))
    np.testing.assert_allclose(motion.q, np.radians(POSITIONS), atol=1e-10)
    assert motion.time[-1] == pytest.approx(0.012 * 49)


def test_measured_ones_are_taken_where_both_are_there(arm, written):
    both = log("ASPos.").replace("\n", "\tAIPos.A1\tAIPos.A2\tAIPos.A3\tAIPos.A4\tAIPos.A5\tAIPos.A6\n", 1)
    both = both.replace("\n4", "\t1\t2\t3\t4\t5\t6\n4").rstrip("\n") + "\t1\t2\t3\t4\t5\t6\n"
    both = both.replace("A6\t1\t2\t3\t4\t5\t6\n", "A6\n", 1)
    motion = ksl.read_motion(arm([f"joint_a{i}" for i in range(1, 7)]), written(both))
    np.testing.assert_allclose(motion.q, np.radians(np.tile(np.arange(1.0, 7), (50, 1))))


@pytest.mark.parametrize("axes", [3, 4])
def test_four_axes_are_a_robot(arm, written, refusal, axes):
    model, text = arm([f"joint_a{i + 1}" for i in range(axes)]), written(log("AIPos.", axes=axes))
    if axes == 4:
        np.testing.assert_allclose(ksl.read_motion(model, text).q, np.radians(POSITIONS[:, :4]), atol=1e-10)
    else:
        assert "KUKA" not in refusal(model, text)


def test_other_robots_need_a_map(arm, written, refusal):
    five = arm([f"axis{i}" for i in range(5)])
    said = refusal(five, written(log("AIPos.")))
    assert "is a recording of a KUKA with 6 joints, and arm has 5: axis0, axis1" in said and '"AIPos.A1" = "JOINT"' in said
    assert "with 6 joints, and arm has 6: rail, v" in refusal(arm(["rail", *"vwxyz"]), written(log("AIPos."))), "a joint that slides has no degrees"
    rules = {f"AIPos.A{i + 1}": {"to": f"axis{i}", "unit": "deg", "sign": -1} for i in range(5)} | {"IPOC": {"to": "time", "unit": "ms"}}
    motion = ksl.read_motion(five, written(log("AIPos.")), map=rules, ignore_extra=True)
    np.testing.assert_allclose(motion.q, -np.radians(POSITIONS[:, :5]), atol=1e-10)
    assert "no column `time`" in refusal(arm(list("uvwxyz")), written(log("AIPos.", clock="count")))
