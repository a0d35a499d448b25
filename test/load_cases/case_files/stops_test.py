"""Stops: their law, where they begin, and the worst start, in closed form."""

import numpy as np
import pytest

from hinged_rods import BODY, HINGE, ROD, files_beside
from ksl.base.errors import CaseError
from ksl.load_cases.case_files import case_file
from ksl.load_cases.case_files.case_file import cases_of_text
from ksl.load_cases.case_files.stops import Stop, worst_start
from ksl.load_cases.case_files.wrenches_over_time import WrenchOverTime
from ksl.load_cases.poses import pose_of
from ksl.motions.motion import Motion


@pytest.mark.parametrize(("samples", "starts"), [(2000, 2000), (4001, 2001), (8001, 2001)])
def test_starts_of_long_motions(samples, starts):
    time = 5 + np.linspace(0, 8, samples)
    assert len(Stop(1.0).starts(Motion(time, *np.zeros((3, samples, 1))))) == starts
    uneven = Motion(np.linspace(0, 2, samples) ** 2, *np.zeros((3, samples, 1)))
    assert (len(Stop(1.0).starts(uneven)) == samples) == (samples <= 2000)


@pytest.mark.parametrize(("early", "begins"), [(0.95e-9, 1), (1.05e-9, 2)])
def test_a_sample_stands_for_a_multiple_that_it_misses_by_round_off(early, begins):
    time = np.array([0.0, 1 - early, 1.5, 2.25])
    assert Stop(1.0, step=1.0).starts(Motion(time, *np.zeros((3, 4, 1)))).tolist() == [0, begins, 3]


@pytest.mark.parametrize("law", ["cubic", "linear"])
def test_the_law_of_a_stop_is_its_own_derivative(law):
    x, h = np.linspace(0.01, 0.99, 50), 1e-5
    way, speed, change = Stop(1.0, law).profile(x)
    (before, v0, _), (after, v1, _) = (Stop(1.0, law).profile(x + d) for d in (-h, h))
    assert (after - before) / (2 * h) == pytest.approx(speed, abs=1e-9) and (v1 - v0) / (2 * h) == pytest.approx(change, abs=1e-9)
    ends = Stop(1.0, law).profile(np.array([0.0, 1.0]))
    assert ends[0].tolist() == [0, 0.5] and ends[1].tolist() == [1, 0]


@pytest.mark.parametrize(("limits", "start"), [((10, 100), 0), ((100, 1), 3), ((0, 100), 3), ((0, 0), 0)])
def test_the_worst_start_is_that_of_the_largest_share(robot, limits, start):
    """Two rods that turn about the vertical, each with m l² = 0.5 kg m²: one is fastest at the first sample, the other at the last."""
    limit = '<limit lower="-9" upper="9" effort="{}" velocity="9"/>'
    joints = "".join(HINGE.format(n, "revolute", "wall", b, limit.format(e)) for n, b, e in zip("pq", "bc", limits, strict=True))
    m = robot(f'<robot name="r"><link name="wall"/>{BODY.format("b")}{BODY.format("c")}{joints}</robot>')
    v = np.array([[4.0, 0.5], [3, 1], [2, 2], [1, 3]])
    assert worst_start(m, Motion(np.arange(4.0), np.zeros((4, 2)), v, np.zeros((4, 2))), Stop(0.5), []) == start


def test_a_wrench_is_held_during_a_stop(robot):
    """Nothing moves: the effort is minus the moment at the start, which is largest at the third sample."""
    m = robot(ROD)
    moment = WrenchOverTime("rod", np.arange(4.0), np.outer([1.0, -2, 7, -6], [0, 0, 0, 0, 0, 1]), "hold", "link", (0, 0, 0))
    still = Motion(np.arange(4.0), *np.zeros((3, 4, 1)))
    assert worst_start(m, still, Stop(0.5), [moment]) == 2
    floating = robot(f'<robot name="f">{BODY.format("b")}</robot>', floating_base=True)
    q = np.tile([0.0, 0, 0, 0, 0, 0, 1], (3, 1))
    for size in (1.0, 1e-3):
        v = np.outer([1.0, -9, 2], [0, 0, 0, 0, 0, size])
        weightless = floating.with_gravity((0.0, 0.0, 0.0))
        assert worst_start(weightless, Motion(np.arange(3.0), q, v, np.zeros((3, 6))), Stop(0.5), []) == 1, "no joint has one coordinate"
    limit = '<limit effort="9" velocity="9"/>'
    hinged = robot(f'<robot name="f">{BODY.format("b")}{BODY.format("c")}{HINGE.format("p", "continuous", "b", "c", limit)}</robot>', floating_base=True)
    assert pose_of(hinged, {"p": 0.5}).tolist() == [0, 0, 0, 0, 0, 0, 1, 0.5], "its quaternion ends before the hinge"
    q, v = np.hstack([q, np.zeros((3, 1))]), np.outer([2.0, 0, 0], [0, 0, 9, 0, 0, 0, 0]) + np.outer([0.0, 1, 3], [0, 0, 0, 0, 0, 0, 1])
    assert worst_start(hinged, Motion(np.arange(3.0), q, v, np.zeros((3, 7))), Stop(0.5), []) == 2, "of the hinge, and not of the base"


@pytest.mark.parametrize(("most", "ok"), [(7, True), (6, False)])
def test_stops_from_every_sample(robot, tmp_path, monkeypatch, most, ok):
    m = robot(ROD)
    (tmp_path / "m.csv").write_text("time,pin\n" + "".join(f"{k / 2},{k / 9}\n" for k in range(7)))
    monkeypatch.setattr(case_file, "MOST_STOPS", most)
    read = lambda: cases_of_text(m, "[cases.a]\nmotion = 'm.csv'\nstop = { time = 1, from = 'all' }\n", str(tmp_path / "c.toml"))
    if ok:
        assert [case.name for case in read()] == [f"a {k / 2:g} s" for k in range(7)]
        return
    with pytest.raises(CaseError, match="case a: stop: 7 starts, at most 6; give a longer step"):
        read()


@pytest.mark.parametrize(("time", "beyond"), [(3.3e-308, True), (3.4e-308, False), (1.0, False), (4.45e307, False), (4.55e307, True)])
def test_stops_within_the_range_of_numbers(robot, tmp_path, time, beyond):
    """From 4 rad/s: neither 1.5 v/T nor v T are beyond 1.8e308."""
    try:
        files_beside(tmp_path)(robot(ROD), f"motion = 'm.csv'\nstop = {{ time = {time!r}, from = 0 }}")
        said = ""
    except CaseError as e:
        said = str(e)
    assert ("from 4 rad/s or m/s the deceleration or the way is beyond the range of numbers" in said) == beyond, said
