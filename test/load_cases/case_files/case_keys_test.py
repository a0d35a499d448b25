"""Keys of a case: the values that each takes, just below and just above, and the doubts about what it names."""

import numpy as np
import pytest

from hinged_rods import ROD, files_beside
from ksl.base.errors import CaseError
from ksl.load_cases.case_files.case_file import cases_of_text


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ("mounting = { quaternion = [0, 0, 0.9901, 0] }", ""), ("mounting = { quaternion = [0, 0, 1.0099, 0] }", ""),
        ("mounting = { quaternion = [0, 0, 0.9899, 0] }", "length 0.9899"), ("mounting = { quaternion = [0, 0, 1.0101, 0] }", "length 1.01"),
        ("payloads = [{ link = 'rod', mass = 1, inertia = [1, 1, 2.0000018, 0, 0, 0] }]", ""),
        ("payloads = [{ link = 'rod', mass = 1, inertia = [1, 1, 2.0000022, 0, 0, 0] }]", "which no body can have"),
        ("payloads = [{ link = 'rod', mass = 1, inertia = [-0.0000011, 1, 1, 0, 0, 0] }]", "which no body can have"),
        ("payloads = [{ link = 'rod', mass = 1, inertia = [-0.0000009, 1, 1, 0, 0, 0] }]", ""), ("payloads = [{ link = 'rod', mass = 1, inertia = [0, 1, 1, 0, 0, 0] }]", ""),
        ("external = [{ link = 'rod', wrench = [0,0,0,0,0,0], order = 'xyz' }]", "order 'xyz'"),
        ("stop = { time = 1, step = 0 }", "step 0; expected seconds"), ("stop = { time = 0 }", "time 0; expected"),
        ("stop = { time = 1, from = 0 }", ""), ("stop = { time = 1, from = 3 }", ""), ("stop = { time = 1, from = 3.01 }", "the motion is from 0 s to 3 s"),
    ],
)  # fmt: skip
def test_what_a_case_takes(robot, tmp_path, keys, says):
    m = robot(ROD)
    (tmp_path / "m.csv").write_text("time,pin\n" + "".join(f"{k / 2},{k / 9}\n" for k in range(7)))
    read = lambda: cases_of_text(m, f"[cases.a]\nmotion = 'm.csv'\n{keys}\n", str(tmp_path / "c.toml"))
    if not says:
        assert len(read()) == 1
        return
    with pytest.raises(CaseError, match=says):
        read()


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ("external = [{ link = 'rod', file = 'w.csv' }]", ["w.csv has no line end"]), ("external = [{ link = 'rod', wrench = [0,0,1,0,0,0], point = [0, 0.8, 0.7] }]", ["the point of external wrench 1, on rod, is 1.06301 m"]),
        ("external = [{ link = 'rod', wrench = [0,0,1,0,0,0], point = [0, 0.7, 0.7] }]", []), ("hold = true", []), ("hold = false\nsimulate = false", []),
        ("external = [{ link = 'rod', wrench = [0,0,1,0,0,0] }, { link = 'rod', file = 'w.csv' }, { link = 'rod', wrench = [0,0,1,0,0,0], point = [2, 0, 0] }]", ["w.csv", "external wrench 3, on rod, is 2 m"]),
    ],
)  # fmt: skip
def test_doubts_about_what_a_case_names(robot, tmp_path, keys, said):
    """Beside those about its motion, and of this case alone."""
    read, m = files_beside(tmp_path), robot(ROD)
    (case, other) = read(m, f"motion = 'm.csv'\n{keys}\n[cases.b]\nmotion = 'm.csv'")
    assert len(case.motion.doubts) == len(said) and not other.motion.doubts
    assert all(words in line for words, line in zip(said, case.motion.doubts, strict=True)), case.motion.doubts
    assert (case.kind, case.brake, case.static) == (("held at rest by brakes", True, True) if "true" in keys else ("motion", False, False))


def test_what_held_and_stopped_motions_share(robot, tmp_path):
    """Doubts about units, and none about noise."""
    noise = np.random.default_rng(0).normal(size=300)
    (tmp_path / "m.csv").write_text("time,pin\n" + "".join(f"{k / 99},{500 * np.sin(k / 50) + x}\n" for k, x in enumerate(noise)))
    moved, held, stopped = cases_of_text(
        robot(ROD), "[defaults]\nmotion = 'm.csv'\n[cases.a]\n[cases.b]\nhold = true\n[cases.c]\nstop = { time = 1, from = 0 }\n", str(tmp_path / "c.toml")
    )
    degrees = [line for line in moved.motion.doubts if "are these degrees?" in line]
    assert len(degrees) == 1 < len(moved.motion.doubts) and held.motion.doubts == stopped.motion.doubts == degrees


def test_physics_of_a_case(robot, tmp_path):
    """Names, or the width of friction alone; what adds joints is refused, since cases of one run have the same."""
    read = files_beside(tmp_path)
    m = robot(ROD.replace("</joint>", '<dynamics damping="0.5" rotor_inertia="0.001" gear_ratio="50"/></joint>'), physics=["damping"])
    for keys, names, width in (
        ("", ("damping",), 0.01),
        ("friction_width = 0.3", ("damping",), 0.3),
        ("physics = ['rotor']", ("rotor",), 0.01),
        ("physics = []\nfriction_width = 0.2", (), 0.2),
    ):
        (case,) = read(m, f"motion = 'm.csv'\n{keys}")
        assert (case.model.physics, case.model.friction_width) == (names, width), keys
    with pytest.raises(CaseError, match='case a: physics "rotor bodies" adds joints'):
        read(m, "motion = 'm.csv'\nphysics = ['rotor bodies']")


@pytest.mark.parametrize("axes", ["world", "ksl:world"])
def test_wrenches_in_axes_of_the_world(robot, tmp_path, axes):
    """Of a rod that has turned by 90°: the world's y is minus its x."""
    read = files_beside(tmp_path)
    (case,) = read(
        robot(ROD),
        f"hold = {{ pose = {{ pin = 1.5707963267948966 }} }}\nexternal = [{{ link = 'rod', wrench = [0, 3, 0, 0, 0, 2], axes = '{axes}', point = [0.5, 0, 0] }}]",
    )
    assert case.external["rod"][0] == pytest.approx([3, 0, 0, 0, 0, 2], abs=1e-12)
