"""Still images: what the traces hold, how large they are, and that plotly.js draws them."""

import base64
import json

import numpy as np
import pytest
from ksl.viewer.scene import make_scene
from ksl.viewer.still import LEVELS, link_colours, still

import ksl

G = 9.81


def points(trace):
    return np.column_stack([np.frombuffer(base64.b64decode(trace[c]["bdata"]), "<f4") for c in "xyz"])


def test_arrows_have_the_length_of_the_legend(arm):
    """Level arm: 3 g upwards at the shoulder, in blue; its moment 2.3 g m about −y, in orange."""
    figure = still(make_scene(arm, [0.0, 0.0]), 0, "shoulder")
    lines = figure["layout"]["annotations"][0]["text"].split("<br>")
    assert "structure: 29.43 N" in lines[0] and "drive: 22.56 N m" in lines[1]
    newtons, moments = (float(part.split()[k]) for part, k in zip(lines[2].removeprefix("1 m of arrow: ").split(", "), (0, 0)))
    reach = points(figure["data"][0])
    assert reach[:, 2].max() == pytest.approx(3 * G / newtons, rel=1e-6)
    assert reach[:, 1].min() == pytest.approx(-2.3 * G / moments, rel=1e-6)


def test_a_floating_base_has_a_support_and_no_drive(examples):
    model = ksl.load(examples / "robots/ur5.urdf", floating_base=True)
    lines = still(make_scene(model), 0, "floating_base")["layout"]["annotations"][0]["text"]
    assert "support: " in lines and "drive" not in lines


def test_a_figure_is_small_and_plain_json(arm):
    figure = json.loads(json.dumps(still(make_scene(arm, [0.0, 0.0]), 0, "elbow"), allow_nan=False))
    assert set(figure) == {"data", "layout"}
    assert len(json.dumps(figure)) < 60_000


def test_the_joint_must_exist(arm):
    with pytest.raises(ValueError, match="did you mean 'elbow'"):
        still(make_scene(arm, [0.0, 0.0]), 0, "ellbow")


def test_links_have_the_colour_of_their_utilisation(arm):
    """Shoulder at 45 % and elbow at 29 %; ten times the load is beyond both limits."""
    assert link_colours(make_scene(arm, [0.0, 0.0]), 0) == {"upper": LEVELS[0][1], "lower": LEVELS[0][1]}
    heavy = make_scene(arm, [0.0, 0.0], external={"hand": [0, 0, -20.0, 0, 0, 0]})  # 22.6 + 32 N m of 50, 2.9 + 12 N m of 10
    assert link_colours(heavy, 0) == {"upper": LEVELS[3][1], "lower": LEVELS[3][1]}
    half = make_scene(arm, [0.0, 0.0], external={"hand": [0, 0, -10.0, 0, 0, 0]})  # 38.6 N m of 50, 8.9 N m of 10
    assert link_colours(half, 0) == {"upper": LEVELS[1][1], "lower": LEVELS[2][1]}


def test_plotly_draws_it(browser, arm):
    """The image isn't blank: it has the blue of the force and the yellow of the link."""
    get_plotlyjs = pytest.importorskip("plotly.offline").get_plotlyjs
    context = browser()
    page = context.new_page()
    page.set_content(f"<script>{get_plotlyjs()}</script>")
    figure = still(make_scene(arm, [0.6, 0.3]), 0, "elbow", width=300, height=260)
    counts = page.evaluate(
        """async figure => {
          const image = new Image();
          image.src = await Plotly.toImage(figure, {format: "png", width: 300, height: 260});
          await image.decode();
          const canvas = new OffscreenCanvas(300, 260), context = canvas.getContext("2d");
          context.drawImage(image, 0, 0);
          const d = context.getImageData(0, 0, 300, 260).data;
          let blue = 0, yellow = 0;
          for (let i = 0; i < d.length; i += 4) {
            if (d[i + 3] > 200 && d[i + 2] > 1.5 * d[i] + 20) blue++;
            if (d[i + 3] > 200 && d[i] > 1.5 * d[i + 2] + 20 && d[i + 1] > 0.6 * d[i]) yellow++;
          }
          return [blue, yellow];
        }""",
        figure,
    )
    context.close()
    assert counts[0] > 100 and counts[1] > 300
