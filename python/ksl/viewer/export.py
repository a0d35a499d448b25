"""A scene and its playback in one HTML file that opens without a network."""

from __future__ import annotations

import os
from ksl.base.markup import html as escape
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ksl._core import __version__
from ksl.base.errors import ViewerError
from ksl.mechanism.states import Array
from ksl.output import OutputError, place_of, whole_file
from ksl.viewer import gate
from ksl.viewer.scene import Scene
from ksl.viewer.scene_tree import Shown, Stage, legend
from ksl.viewer.viser_server import start_server, stop_server

FEWEST, MOST, FRAMES = 300, 900, 30
"""States in the file: FRAMES for each second, but at least FEWEST and at most MOST where the motion has so many."""

POLICY = f'<meta http-equiv="Content-Security-Policy" content="{gate.POLICY.format(connect="")}">'
"""The file asks for nothing from the network, whatever it holds."""

OVERLAY = """
<div id="ksl-legend" style="position:fixed;left:12px;top:10px;z-index:1;pointer-events:none;font:13px/1.45 system-ui,sans-serif;color:#222;
background:rgba(255,255,255,0.75);padding:6px 10px;border-radius:4px;max-width:44em">{}</div>
"""


def export(scene: Scene, path: str | os.PathLike[str], *, joint: str | None = None, subtitle: str = "") -> Path:
    """Writes the scene and its playback into one HTML file, which needs no network, and returns its path.

    joint: whose wrench is written beside it, by default that whose drive comes nearest to its limit.  subtitle: a line below the robot's name.
    The file has a time line, speeds, and the tree of the scene, whose parts can be hidden and shown.  About 1 MB, and what the surfaces
    and the states need.  Written completely or not at all; ViewerError where that fails, or the extra ksl[view] is missing.
    """
    target = Path(path)
    try:
        place_of(target)  # before the page is made, which takes seconds
        selected = joint if joint is not None else scene.worst_joint()
        scene.joint_index(selected)
        html = _html(scene, Shown(selected=selected, recorded=True))
        head, end, tail = html.rpartition("</body>")
        with whole_file(target) as part:
            part.write_text(
                head.replace("<head>", f"<head>{POLICY}", 1) + OVERLAY.format(_legend(scene, subtitle)) + end + tail, encoding="utf-8", errors="replace"
            )
    except OutputError as e:
        raise ViewerError(str(e)) from None
    return target


def _html(scene: Scene, shown: Shown) -> str:
    server, _ = start_server(None, scene.model.name)
    try:
        stage = Stage(server, scene, shown)
        recording = server.get_scene_serializer()
        chosen = frames(scene.time)
        for k, sample in enumerate(chosen[1:]):
            recording.insert_sleep(float(scene.time[sample] - scene.time[chosen[k]]))
            stage.show(scene, int(sample))
        return str(recording.as_html())
    finally:
        stop_server(server)


def frames(time: Array) -> NDArray[np.intp]:
    """Indices of the states in the file: evenly spread in time, the first and the last among them."""
    count = int(np.clip(FRAMES * (time[-1] - time[0]), FEWEST, MOST))
    if len(time) <= count:
        return np.arange(len(time))
    nearest = np.searchsorted(time, np.linspace(time[0], time[-1], count))
    return np.unique(np.concatenate([[0], np.clip(nearest, 0, len(time) - 1), [len(time) - 1]]))


def _legend(scene: Scene, subtitle: str) -> str:
    lines = [f"<b>{escape(scene.model.name)}</b>"] + ([escape(subtitle)] if subtitle else [])
    for colour, text in legend(scene):
        lines.append(escape(text) if colour is None else f'<span style="color:rgb{colour}">■</span> {escape(text)}')
    lines += [f"<i>{escape(note)}</i>" for note in [*filter(None, [scene.unloaded]), *scene.look.notes[:3]]]
    return "<br>".join([*lines, f'<span style="color:#777">KSL {__version__}</span>'])
