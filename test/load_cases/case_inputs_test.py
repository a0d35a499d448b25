"""Motions and wrenches that are given as arrays, what is doubted of a payload or a point, and numbers beyond the range."""

from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest

from hinged_rods import BODY, HINGE, ROD
from ksl.base.errors import MotionError
from ksl.load_cases import load_case
from ksl.load_cases.case_files.motion_given import motion_given
from ksl.load_cases.case_result import compute_case
from ksl.load_cases.load_case import LoadCase, Payload, Placement
from ksl.load_cases.wrench_table import wrenches_of_arrays
from ksl.motions.motion import Motion


@pytest.mark.parametrize(("mass", "doubted"), [(9.99, False), (10.01, True)])
def test_a_payload_of_five_times_the_robot_is_suspected(robot, mass, doubted):
    m = robot(ROD)
    case = LoadCase(m.with_payload("rod", mass, (0, 0, 0)), Motion(np.zeros(1), *np.zeros((3, 1, 1))), payloads=[Payload("rod", mass, (0.0, 0.0, 0.0))])
    said = [line for line in compute_case(case).doubts if line.startswith("the payload on rod has")]
    assert bool(said) == doubted and all(f"{mass:g} kg, 5 times the robot's own 2 kg" in line for line in said)


def test_a_payload_on_a_robot_without_masses_is_none_of_grams(robot):
    m = robot(
        '<robot name="r"><link name="wall"/><link name="rod"/><joint name="pin" type="continuous"><parent link="wall"/><child link="rod"/><axis xyz="0 0 1"/></joint></robot>',
        masses="optional",
    )
    case = LoadCase(m.with_payload("rod", 500, (0, 0, 0)), Motion(np.zeros(1), *np.zeros((3, 1, 1))), payloads=[Payload("rod", 500.0, (0.0, 0.0, 0.0))])
    assert not [line for line in compute_case(case).doubts if "grams" in line]


def test_rates_of_a_table_are_taken_if_all_are_there(robot):
    """Otherwise they are differentiated; here they are none of the positions."""
    joints = HINGE.format("p", "continuous", "wall", "b", "") + HINGE.format("q", "continuous", "b", "c", "")
    m, t = robot(f'<robot name="r"><link name="wall"/>{BODY.format("b")}{BODY.format("c")}{joints}</robot>'), np.linspace(0, 1, 30)
    table = {"time": t, "p": t, "q": 2 * t, "p.v": 7 + 0 * t, "q.v": 8 + 0 * t, "p.a": 5 + 0 * t}
    whole, part = (motion_given(m, pa.table({name: x for name, x in table.items() if name != left_out})) for left_out in ("p.a", "q.v"))
    assert whole.v[3].tolist() == [7, 8] and part.v[3] == pytest.approx([1, 2], abs=1e-9)
    both = motion_given(m, pa.table(table | {"q.a": 6 + 0 * t}))
    assert both.v[3].tolist() == [7, 8] and both.a[3].tolist() == [5, 6] and np.abs(whole.a).max() < 1e-6


def test_arrays_of_a_motion(robot):
    m, t, x = robot(ROD), np.arange(2.0), np.zeros((2, 1))
    assert motion_given(m, (t, x, x, x)).q.shape == (2, 1)
    for wrong in ((t,), (t, x, x, x, x), 3):
        with pytest.raises(MotionError, match="expected a file, a table with the column `time`"):
            motion_given(m, wrong)
    with pytest.raises(MotionError, match="sample 2: time 0 after 0; times must increase: sort the samples"):
        motion_given(m, (np.zeros(2), x, x, x))
    with pytest.raises(MotionError, match="sample 5: time 0 after 3; times must increase: 2 recordings follow one another, the first in 4 samples"):
        motion_given(m, (np.tile(np.arange(4.0), 2), np.zeros((8, 1))))


@pytest.mark.parametrize("rows", [1 << 17, 4])
@pytest.mark.parametrize("sample", [0, 3])
def test_numbers_beyond_the_range_name_sample_and_quantity(robot, monkeypatch, sample, rows):
    """An acceleration that is an effort, and with its speed a power that is none; and a speed whose square is none.  In one block or in several."""
    monkeypatch.setattr(load_case, "BLOCK_ROWS", rows)
    for speed, acceleration, said in ((1e100, 1e250, "power of pin is not finite"), (1e300, 0.0, "inverse_dynamics_with_reactions: ")):
        v, a = (np.where(np.arange(5) == sample, x, 0.0)[:, None] for x in (speed, acceleration))
        with pytest.raises(MotionError, match=rf"motion: sample {sample + 1} \(time {sample}\): {said}"):
            compute_case(LoadCase(robot(ROD), Motion(np.arange(5.0), np.zeros((5, 1)), v, a)))


@pytest.mark.parametrize("shape", [(6,), (1, 6), (3, 6)])
def test_wrenches_for_all_samples(shape):
    wrench = np.arange(1.0, 1 + np.prod(shape)).reshape(shape)
    assert wrenches_of_arrays({"rod": wrench}, 3)["rod"].tolist() == np.broadcast_to(wrench, (3, 6)).tolist()


@pytest.mark.parametrize(
    ("placement", "payload", "said"),
    [
        ({"at": (0, 0, 0.99)}, None, ""), ({"at": (0, 0, -1.01)}, None, "the point of the moments is 1.01 m from the joint's origin"), ({"at": "world"}, None, ""),
        ({"points": {"pin": (0.0, 1.01, 0.0)}}, None, "the point of the moments of pin is 1.01 m"), ({"points": {"pin": (0.0, 0.99, 0.0)}}, None, ""),
        ({}, {"center": (0.0, 0.0, -0.99)}, ""), ({}, {"center": (0.8, 0.8, 0.0)}, "the payload on rod is 1.13137 m from the link's origin"),
        ({}, {"center": (0.0, 0.0, 0.0), "inertia": (0.99, 0, 0, 0, 0.99, 0, 0, 0, 0.99)}, ""),
        ({}, {"center": (0.0, 0.0, 0.0), "inertia": (1.03, 0, 0, 0, 1.03, 0, 0, 0, 1.03)}, "the inertia of the payload on rod is that of a body with a radius of 1.015 m"),
    ],
)  # fmt: skip
def test_lengths_beyond_twice_the_extent_are_doubted(robot, placement, payload, said):
    """Of a rod of 0.5 m: points of moments, payloads, and the radius √(I/m) of their inertia."""
    m, carried = robot(ROD), [Payload("rod", 1.0, **payload)] if payload else []
    for p in carried:
        m = m.with_payload(p.link, p.mass, p.center, None if p.inertia is None else np.reshape(p.inertia, (3, 3)))
    case = LoadCase(m, Motion(np.zeros(1), *np.zeros((3, 1, 1))), Placement(**placement), payloads=carried)
    doubts = [line for line in compute_case(case).doubts if "robot's extent" in line]
    assert len(doubts) == bool(said) and all(line.startswith(said) for line in doubts)


@pytest.mark.parametrize(("file", "named"), [("m.csv", "m.csv"), ("", "lift")])
def test_errors_name_the_file_of_a_motion_or_its_case(robot, file, named):
    far = Motion(np.zeros(1), np.zeros((1, 1)), np.full((1, 1), 1e300), np.zeros((1, 1)))
    for motion, said in ((far, "sample 1 "), (replace(far, v=np.full((1, 1), 1e200), a=np.full((1, 1), 1e200)), "sample 1 ")):
        with pytest.raises(MotionError, match=f"^{named}: {said}"):
            compute_case(LoadCase(robot(ROD), motion, name="lift", motion_file=file))
