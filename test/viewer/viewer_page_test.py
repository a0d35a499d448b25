"""The viewer in a real browser: what the page draws is read from its scene and compared with the model."""

import contextlib
import time

import numpy as np
import pytest

pytest.importorskip("viser", reason="the package viser is not installed")

READY = "() => window.__viserMutable && window.__viserMutable.nodeRefFromName['/links/upper/surface0'] && window.__viserMutable.nodeRefFromName['/drive/heads']"
POSITION = "name => window.__viserMutable.nodeRefFromName[name].position.toArray()"
MATRICES = """name => {
  let found = null;
  window.__viserMutable.nodeRefFromName[name].traverse(o => { if (o.isInstancedMesh2) found = o; });
  return found && Array.from(found.matricesTexture.image.data).slice(0, 16 * found.instancesCount);  // `count` leaves out what is not in sight
}"""


@contextlib.contextmanager
def page_of(browser, url: str, offline: bool = False):
    """A page, once it is ready; fails if the page reports an error."""
    context = browser()
    page = context.new_page()
    faults = []
    page.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: faults.append(str(error)))
    if offline:
        page.route(
            "**/*",
            lambda route: route.continue_() if route.request.url.startswith(("file:", "data:", "blob:")) else (faults.append(route.request.url), route.abort()),
        )
    page.goto(url)
    page.wait_for_function(READY, timeout=60_000)
    yield page
    context.close()
    assert faults == []


def until(condition, seconds: float = 60.0, page=None):
    """Waits until a condition holds; the page works on meanwhile."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        page.wait_for_timeout(50) if page else time.sleep(0.05)


def at(page, link: str):
    return np.array(page.evaluate(POSITION, f"/links/{link}"))


def arrow_lengths(page, name: str):
    """Lengths (joints, 2) of the arrows of forces and moments, m: shafts and heads together."""
    shafts, heads = (np.array(page.evaluate(MATRICES, f"/{name}/{part}")).reshape(-1, 4, 4) for part in ("shafts", "heads"))
    along = [np.linalg.norm(x[:, 2, :3], axis=1) for x in (shafts, heads)]  # columns of matrices are rows here: the third is the image of z
    shaft, head = along[0].reshape(-1, 2), along[1].reshape(-1, 3)
    return np.column_stack([shaft[:, 0] + head[:, 0], shaft[:, 1] + head[:, 1] + head[:, 2]])


@pytest.fixture(scope="module")
def live(browser, arm, swing):
    """The viewer and its page; tests share them, since a page without a graphics card is slow."""
    from ksl.viewer.live import Viewer
    from ksl.viewer.scene import make_scene

    t, q, v, a = swing
    with Viewer(make_scene(arm, q, v, a, t)) as viewer, page_of(browser, viewer.url) as page:
        yield viewer, page


def test_the_page_shows_the_first_state(live):
    viewer, page = live
    np.testing.assert_allclose(at(page, "hand"), viewer.scene.poses[0, 3, :3, 3], atol=1e-6)


def test_a_slider_moves_the_hand_and_arrows_have_the_length_of_the_numbers(live, arm, swing):
    viewer, page = live
    field = page.get_by_text("shoulder, rad", exact=True).locator("xpath=ancestor::*[.//input][1]").locator("input").last
    field.fill("0.7")
    field.press("Enter")
    until(lambda: abs(viewer.scene.q[viewer.sample, 0] - 0.7) < 1e-9, page=page)
    q = np.array([0.7, swing[1][0, 1]])
    hand = arm.frame_pose(q, "hand")[:3, 3]
    until(lambda: np.allclose(at(page, "hand"), hand, atol=1e-6), page=page)

    scale, names = viewer.stage.scene.scale, [j.name for j in arm.joints]
    for node, part in (("structure", "constraint"), ("drive", "actuation")):  # a pose that is set by hand is at rest
        wrench = arm.reactions(q, np.zeros(2), np.zeros(2), axes="world", part=part, joints=names[:2])
        expected = np.column_stack([np.linalg.norm(wrench[:, :3], axis=1) * scale.force, np.linalg.norm(wrench[:, 3:], axis=1) * scale.moment])
        until(lambda node=node, expected=expected: np.allclose(arrow_lengths(page, node)[:2], expected, atol=1e-6), page=page)
        assert not arrow_lengths(page, node)[2:].any(), "fixed joints have no arrows at first"
    assert page.get_by_text("at rest in this pose").count() == 1


def test_playback_reaches_the_end(live, arm, swing):
    viewer, page = live
    viewer.controls.set_speed(4)
    page.get_by_role("button", name="Play").click()
    last = arm.frame_pose(swing[1][-1], "hand")[:3, 3]
    until(lambda: viewer.sample == 200 and not viewer.playing, page=page)
    until(lambda: np.allclose(at(page, "hand"), last, atol=1e-6), page=page)
    assert page.get_by_role("button", name="Play").count() == 1


def test_an_exported_file_plays_without_a_network(browser, arm, swing, tmp_path):
    from ksl.viewer.export import export
    from ksl.viewer.scene import make_scene

    t, q, v, a = swing
    path = export(make_scene(arm, q, v, a, t), tmp_path / "arm.html")
    assert path.stat().st_size < 3e6
    with page_of(browser, path.as_uri(), offline=True) as page:
        last = arm.frame_pose(q[-1], "hand")[:3, 3]

        def at_the_end() -> bool:
            """Asks for the last time, again and again: the page forgets it if the recording is still being read."""
            for seconds in ("1.0", "2.0"):
                page.locator("input").first.fill(seconds)
            page.wait_for_timeout(500)
            return np.allclose(at(page, "hand"), last, atol=1e-6)

        until(at_the_end, page=page)
        assert "1 m is" in page.locator("#ksl-legend").inner_text()
