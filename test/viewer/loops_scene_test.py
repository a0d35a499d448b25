"""Scenes of closed mechanisms: joints that close loops, what a slider leads, what is said where there are no wrenches.

A crank slider in the vertical plane: crank 0.3 m, rod 0.5 m, and a slider of 2 kg along x; the pin joins rod and slider.  The masses of crank and
rod are negligible beside it, so that the rod carries a force along itself, and none where nothing acts on the slider.
"""

import math

import ksl
import numpy as np
import pytest
from ksl.viewer.closing import led_coordinates, moved_to
from ksl.viewer.export import _legend
from ksl.viewer.controls import coordinates
from ksl.viewer.readout import Choice, readout, wrench_at
from ksl.viewer.results_scene import scene_of_motion
from ksl.viewer.scene import make_scene, resting_position
from ksl.viewer.still import still
from ksl_command import run_ksl

CRANK, ROD = 0.3, 0.5


def crank_slider(driven=True, guide=0.0, name="pin", crank="crank"):
    b = ksl.Builder("press").add_link("ground")
    b.add_link("wheel", 1e-9).add_link("rod", 1e-9).add_link("piston", 2.0)
    b.add_joint(crank, "revolute", "ground", "wheel", axis=(0, -1, 0))
    b.add_joint("knee", "revolute", "wheel", "rod", xyz=(CRANK, 0, 0), axis=(0, -1, 0))
    b.add_joint("guide", "prismatic", "ground", "piston", xyz=(0.5, 0, guide), axis=(1, 0, 0))
    end = np.eye(4)
    end[0, 3] = ROD
    b.add_loop(name, "revolute", "rod", "piston", end, np.eye(4), axis=(0, -1, 0))
    return b.build(drives=[crank] if driven else None)


def closed(angle):
    """Positions of crank, knee and guide, the rod pointing to the right."""
    knee = -angle - math.asin(CRANK * math.sin(angle) / ROD)
    return np.array([angle, knee, CRANK * math.cos(angle) + ROD * math.cos(angle + knee) - 0.5])


PUSH = {"piston": [-100.0, 0, 0, 0, 0, 0]}


def test_wrenches_of_the_pin_are_those_of_the_rod():
    """100 N push the piston to the left: the rod carries 100 N / cos β along itself, and its end pushes the piston to the right."""
    m, q = crank_slider(), closed(0.6)
    scene = make_scene(m, q, external=PUSH)
    pin, beta = scene.joint_index("pin"), math.asin(CRANK * math.sin(0.6) / ROD)
    assert [j.name for j in scene.joints] == [*(j.name for j in m.joints), "pin"] and scene.constraint.shape[1] == len(m.joints) + 1 == pin + 1
    np.testing.assert_allclose(scene.constraint[0, pin, :3], [100, 0, -100 * math.tan(beta)], rtol=1e-6)
    np.testing.assert_allclose(scene.actuation[0, pin], 0, atol=1e-9)
    np.testing.assert_allclose(scene.origins[0, pin], [q[2] + 0.5, 0, 0], atol=1e-12)
    np.testing.assert_allclose(scene.predecessors[0, 0], scene.origins[0, pin], atol=1e-11)
    effort = -100 * CRANK * (math.sin(0.6) + math.cos(0.6) * math.tan(beta))  # by virtual work
    np.testing.assert_allclose(scene.effort[0], [effort, *[np.nan] * (len(scene.joints) - 1)], rtol=1e-6)
    np.testing.assert_allclose(wrench_at(scene, 0, "pin", Choice(on="parent", axes="world"))[:3], [-100, 0, 100 * math.tan(beta)], rtol=1e-6)
    assert "force, N | 100 |" in readout(scene, 0, "pin", Choice()) and "effort" not in readout(scene, 0, "pin", Choice())
    assert scene.worst_joint() == "crank" and not scene.unloaded


def test_rod_and_pin_are_drawn():
    """Bones lead to both sides of the pin, its mark is along its axis, and nothing is open; the image of the report has its arrow."""
    m, q = crank_slider(), closed(0.6)
    scene = make_scene(m, q, external=PUSH)
    end = [q[2] + 0.5, 0, 0]
    knee = [CRANK * math.cos(0.6), 0, CRANK * math.sin(0.6)]
    assert any(np.allclose(bone, [knee, end]) for bone in scene.bones(0))
    (mark,) = scene.loop_marks(0)
    np.testing.assert_allclose(np.cross(mark[1] - mark[0], [0, 1, 0]), 0, atol=1e-12)
    np.testing.assert_allclose(mark.mean(axis=0), end, atol=1e-12)
    assert not np.ptp(scene.loop_gaps(0), axis=1).any()
    force = 100 / math.cos(math.asin(CRANK * math.sin(0.6) / ROD))
    assert f"structure: {force:.4g} N" in still(scene, 0, "pin")["layout"]["annotations"][0]["text"]


def test_an_open_state_is_drawn_with_its_gap_and_without_wrenches():
    scene = make_scene(crank_slider(), [0.6, 0.0, 0.0])
    assert "pin is open at this position" in scene.unloaded and not scene.constraint.any() and np.isnan(scene.effort).all()
    np.testing.assert_allclose(scene.loop_gaps(0)[0], [[0.8 * math.cos(0.6), 0, 0.8 * math.sin(0.6)], [0.5, 0, 0]], atol=1e-12)
    assert "no wrenches" in readout(scene, 0, "pin", Choice()) and "open at this position" in _legend(scene, "")
    with pytest.raises(ValueError, match="is open at this position"):
        make_scene(crank_slider(), [closed(0.6), [0.6, 0.0, 0.0]])
    with pytest.raises(ValueError, match="no link named 'pistn'"):
        make_scene(crank_slider(), [0.6, 0.0, 0.0], external={"pistn": np.zeros(6)})


def test_without_drives_there_are_no_wrenches():
    scene = make_scene(crank_slider(driven=False), [closed(0.6), closed(0.7)])
    assert "joints that have motors are not known" in scene.unloaded and scene.poses.shape[0] == 2
    assert not np.ptp(scene.loop_gaps(1), axis=1).any()


def test_the_resting_position_is_closed():
    m = crank_slider()
    assert abs(m.loop_error(resting_position(m))).max() < 1e-9
    apart = crank_slider(guide=3.0)
    np.testing.assert_array_equal(resting_position(apart), apart.neutral())


def test_a_slider_leads_the_mechanism_and_stops_where_it_does_not_follow():
    """In a guide 0.6 m above the crank's axis the pin needs a crank that is 0.6 − 0.5 m high at least."""
    m = crank_slider()
    led = led_coordinates(m, closed(0.6))
    assert led == [0] and [label for _, label, *_ in coordinates(make_scene(m, closed(0.6)), led)] == ["crank, rad"]
    reached = moved_to(m, closed(0.6), 0, 2.5, led)
    assert reached.reason == "closed"
    np.testing.assert_allclose(reached.q, closed(2.5), atol=1e-9)
    high = crank_slider(guide=0.6)
    start = high.close([1.0, -1.2, 0.0], hold=["crank"])
    assert start.converged
    reached = moved_to(high, start.q, 0, -2.0, [0])
    limit = math.asin((0.6 - ROD) / CRANK)
    assert reached.reason != "closed" and limit <= reached.q[0] < limit + 0.06 and abs(high.loop_error(reached.q)).max() < 1e-9


def test_a_slider_of_the_page_leads_the_mechanism_and_says_where_it_ends(monkeypatch):
    """What it says has the names of joints in it, which are text there."""
    pytest.importorskip("viser")
    from ksl.viewer.live import Viewer

    m = crank_slider(guide=0.6, crank="<b>crank")
    start = m.close([1.0, -1.2, 0.0], hold=["<b>crank"]).q
    with Viewer(make_scene(m, start)) as viewer:
        ((index, slider),) = viewer.controls._sliders.items()
        for value, reason in ((1.2, ""), (-2.0, "&lt;b&gt;crank, rad: -2 is not reached (")):
            slider.value = value
            viewer.controls._lead(viewer.scene.q[0].copy(), index, slider)
            assert reason in viewer.controls._said.content and bool(viewer.controls._said.content) == bool(reason)
            assert viewer.scene.q[0, 0] == pytest.approx(max(value, math.asin(0.1 / CRANK)), abs=0.06) and not viewer.scene.unloaded
            assert slider.value == pytest.approx(viewer.scene.q[0, 0], abs=1e-6)
        viewer.update([0.6, 0.0, 0.0])
        assert "loop joint pin is open at this position" in viewer.controls._said.content


def test_a_motion_is_shown_with_the_wrenches_of_the_pin():
    """The piston's inertia: 2 kg times its acceleration along x."""
    from ksl.viewer.live import _differentiated

    m, t = crank_slider(), np.linspace(0, 1, 201)
    q = np.array([closed(x) for x in 0.6 + 0.3 * np.sin(3 * t)])
    scene = scene_of_motion(m, t, q, *_differentiated(m, t, q, None, None), {})
    np.testing.assert_allclose(scene.v[:, 0], 0.9 * np.cos(3 * t), atol=1e-5)
    x = np.gradient(np.gradient(q[:, 2], t), t)
    np.testing.assert_allclose(scene.constraint[5:-5, scene.joint_index("pin"), 0], 2 * x[5:-5], atol=2e-3)


def test_results_say_which_drives_there_were(tmp_path, monkeypatch):
    """The command that shows results needs no options; without them a robot file that names no drives has no wrenches."""
    pytest.importorskip("viser")
    monkeypatch.chdir(tmp_path)
    assert "<constraint" in crank_slider(driven=False).to_urdf("press.urdf")
    t = np.linspace(0, 1, 51)
    np.savetxt("m.csv", np.column_stack([t, 0.6 + 0.3 * np.sin(3 * t)]), delimiter=",", header="time,crank", comments="")
    assert run_ksl("loads", "press.urdf", "m.csv", "--drives", "crank", "-o", "out").returncode == 0
    shown = run_ksl("view", "press.urdf", "out", "--joint", "pin", "--export", "press.html")
    assert shown.returncode == 0 and "note" not in shown.stderr, shown.stderr
    assert "joints that close loops" in (tmp_path / "press.html").read_text()


def test_a_notebook_shows_the_closed_position():
    html = crank_slider(name="<pin>")._repr_html_()
    assert "1 degree of freedom of 3 coordinates, 1 joint closes loops" in html and "<title>&lt;pin&gt;</title>" in html
    assert "3 coordinates, 1 joint closes loops, and no closed position was found" in crank_slider(guide=3.0)._repr_html_()
