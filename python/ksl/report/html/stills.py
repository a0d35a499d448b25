"""Pictures of the mechanism at the sample where a joint bears most, with the joint's wrench drawn."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import unescape
from ksl.base.markup import html as escape
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ksl.load_cases.reaction_joints import LoopJoint
from ksl.load_cases.quantities import JointLoads, first_extreme, unit
from ksl.mechanism.mechanism import Joint
from ksl.report.html.numbers import format_number, peak

if TYPE_CHECKING:
    from ksl.load_cases.load_case import LoadCase
    from ksl.model.model import Model
    from ksl.viewer.visuals import Appearance

TRIANGLES_OF_ALL = 24_000
"""The triangles of all pictures of a page together: 0.5 MB."""
FEWEST_TRIANGLES, MOST_TRIANGLES = 600, 3000
"""The fewest and the most triangles of one picture."""
WIDTH, HEIGHT = 560, 320
"""The size of a picture, in the pixels of a style sheet."""


@dataclass(frozen=True)
class Still:
    """A picture, which the page renders with plotly.js."""

    figure: dict[str, Any]
    """{"data": …, "layout": …} for plotly.js."""
    legend: tuple[tuple[str, str], ...]
    """Lines below it: a colour, or nothing, and a text."""
    caption: str
    """What is largest there."""
    time: float
    """s."""


def appearance_of(case: LoadCase) -> Appearance:
    """What the robot looks like.  Reading its meshes takes longer than drawing it, so that load cases share it."""
    from ksl.viewer.visuals import appearance

    return appearance(case.model)


def stills_of(case: LoadCase, joints: Sequence[JointLoads], look: Appearance | None = None) -> dict[str, Still]:
    """A picture for each moving joint, those that close loops, and for the joint between ground and robot, at its worst sample.

    look: the appearance of the same robot, if it was read before.

    Meshes that can't be found or read are drawn as the viewer draws them: ellipsoids of inertia.  O(joints · triangles), besides
    reading meshes.
    """
    from ksl.viewer.scene import make_scene
    from ksl.viewer.still import still

    shown = [loads for loads in joints if loads.joint.nv or loads.joint.parent is None or isinstance(loads.joint, LoopJoint)]
    if not shown:
        return {}
    worst = [largest_load(loads) for loads in shown]
    m, samples = case.motion, np.array([load.sample for load in worst], dtype=np.intp)
    external = {link: w[samples] for link, w in case.external.items()}
    scene = make_scene(cast("Model", case.model), m.q[samples], m.v[samples], m.a[samples], m.time[samples], external, look=look)
    triangles = min(MOST_TRIANGLES, max(FEWEST_TRIANGLES, TRIANGLES_OF_ALL // len(shown)))
    stills = {}
    for i, (loads, load) in enumerate(zip(shown, worst, strict=True)):
        figure = still(scene, i, loads.joint.name, triangles=triangles, width=WIDTH, height=HEIGHT)
        legend = _take_legend(figure["layout"])
        stills[loads.joint.name] = Still(figure, legend, load.caption(loads.joint), float(m.time[load.sample]))
    return stills


@dataclass(frozen=True)
class LargestLoad:
    """What a joint bears most, and when."""

    quantity: str
    sample: int
    value: float
    """The magnitude."""

    def caption(self, joint: Joint) -> str:
        words = {"effort": "largest effort", "brake": "largest effort of the brake", "coupling": "largest effort of the coupling"}.get(
            self.quantity, f"largest {self.quantity.replace('_', ' ')}"
        )
        return f"{words}: {format_number(self.value)} {unit(self.quantity, joint)}"


def largest_load(loads: JointLoads) -> LargestLoad:
    """The largest effort of brake and drive, or of the coupling; of joints without either the largest moment, or force."""
    if loads.effort is not None:
        name, x = "effort", loads.effort
        if loads.brake is not None and peak(loads.brake) >= peak(x):
            name, x = "brake", loads.brake
    elif loads.coupling is not None:
        name, x = "coupling", loads.coupling
    else:
        names = ("bending_moment", "radial_force") if "bending_moment" in loads.wrench else ("moment", "force")
        name = names[0] if np.any(loads.wrench[names[0]]) else names[1]
        x = loads.wrench[name]
    k = first_extreme(np.abs(x))
    return LargestLoad(name, k, abs(float(x[k])))


def still_figure(still: Still, number: int, time: str) -> str:
    """The element that the script draws picture `number` of the page's data into."""
    lines = "".join(f"<li>{_swatch(colour)}{escape(text)}</li>" for colour, text in still.legend)
    return (
        f'<figure class="pose"><figcaption>Pose and wrench <small>at {time} s: {escape(still.caption)}</small></figcaption>'
        f'<div class="still" data-still="{number}" role="img" aria-label="The mechanism at {time} s">The picture is drawn when it comes into sight.</div>'
        f'<ul class="legend">{lines}</ul></figure>'
    )


def _swatch(colour: str) -> str:
    return f'<span class="swatch" style="background:{colour}"></span>' if colour else ""


def _take_legend(layout: dict[str, Any]) -> tuple[tuple[str, str], ...]:
    """Removes the legend from a picture and returns its lines: as text of the page it suits light and dark, and can be selected."""
    lines = [line for note in layout.pop("annotations", []) for line in note["text"].split("<br>")]
    layout["height"] -= layout["margin"]["b"]
    layout["margin"]["b"] = 0
    found = [re.match(r'<span style="color:(rgb\([\d, ]+\))">■</span> (.*)', line, re.DOTALL) for line in lines]
    return tuple(("", line) if match is None else (match[1], unescape(match[2])) for match, line in zip(found, lines, strict=True))
