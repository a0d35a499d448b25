"""The panel beside the picture: playback, the readout of a joint, what is shown, and sliders of joints."""

from __future__ import annotations

import time as clock
from collections.abc import Collection, Mapping
from threading import RLock
from typing import TYPE_CHECKING, Any, Protocol, cast

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.markup import html
from ksl.mechanism.states import Array, Part, Side
from ksl.viewer.closing import Reached, led_coordinates, moved_to
from ksl.viewer.labels import labels
from ksl.viewer.readout import Choice, OfLink, readout
from ksl.viewer.scene import Scene
from ksl.viewer.scene_tree import Shown, Stage, legend, utilisation_legend

if TYPE_CHECKING:
    import viser

SLIDER_RATE = 5
"""How often in a second the sliders of joints follow the playback."""

NOTE = "padding:0 0.9em 0.6em;font-size:0.8em;font-style:italic;overflow-wrap:anywhere"
"""Style of sentences of ours, with names from files in them, in the panel."""

SPEEDS = ("0.1", "0.25", "0.5", "1", "2", "4", "8")


class ControlledViewer(Protocol):
    """What the panel asks of the viewer, `ksl.viewer.live.Viewer`."""

    server: viser.ViserServer
    scene: Scene
    """What is shown; `recorded` is the motion that is played."""
    recorded: Scene
    sample: int
    scenes: Mapping[str, Scene]
    playing: bool
    shown: Shown
    stage: Stage
    lock: RLock
    """Held while what is shown changes."""

    def show(self, sample: int | None = None, scene: Scene | None = None) -> None: ...
    def choose(self, title: str) -> None: ...
    def update(self, q: ArrayLike) -> None: ...
    def play(self) -> None: ...


class Controls:
    """What the panel holds, and what moving it does to the viewer."""

    def __init__(self, viewer: ControlledViewer) -> None:
        self._viewer, self._gui, scene = viewer, viewer.server.gui, viewer.scene
        self._speed: Any = None
        self._time: Any = cast(Any, None)
        self._following = False
        self._followed = 0.0
        self._gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
        self._gui.main_panel.dock_right()
        if len(scene.time) > 1:
            self._add_playback(scene)
        self._add_joint(scene)
        self._add_toggles(scene)
        self._add_sliders(scene)
        self.follow()

    @property
    def speed(self) -> float:
        return float(self._speed.value)

    def set_speed(self, speed: float) -> None:
        """Playback at one of `SPEEDS`, or the nearest of them."""
        self._speed.value = min(SPEEDS, key=lambda s: abs(float(s) - speed))

    def follow(self) -> None:
        """Brings readout, time line and sliders to the state that is shown."""
        viewer, scene = self._viewer, self._viewer.scene
        self._following = True
        try:
            self._readout.content = self._text()
            if self._led is not None:
                self._say("")
            if self._time is not None:
                if scene is viewer.recorded:
                    self._time.value = float(scene.time[viewer.sample])
                self._play.label = "Pause" if viewer.playing else "Play"
            now = clock.perf_counter()
            if not viewer.playing or now - self._followed > 1 / SLIDER_RATE:
                self._followed = now
                q = scene.q[viewer.sample]
                for index, slider in self._sliders.items():
                    if slider.value != round(float(q[index]), 6):
                        slider.value = float(np.clip(round(float(q[index]), 6), slider.min, slider.max))
        finally:
            self._following = False

    def _by_hand(self, event: Any) -> bool:
        """Whether somebody moved a control in the page, rather than this program."""
        return event.client is not None and not self._following

    # ------------------------------------------------------------------------------------------------------- playback

    def _add_playback(self, scene: Scene) -> None:
        start, end = float(scene.time[0]), float(scene.time[-1])
        with self._gui.add_folder("Playback"):
            self._play: Any = self._gui.add_button("Play")
            self._time = self._gui.add_slider("time, s", start, end, step=max((end - start) / 5000, 1e-6), initial_value=start)
            self._speed = self._gui.add_dropdown("speed", SPEEDS, initial_value="1")
            if titles := list(self._viewer.scenes):
                self._scene: Any = self._gui.add_dropdown("shape", titles, initial_value=titles[0])
                self._scene.on_update(lambda _: self._viewer.choose(self._scene.value))
            else:
                self._worst: Any = self._gui.add_button("Largest effort of the selected joint")
                self._worst.on_click(self._show_worst)

        self._play.on_click(self._play_or_pause)
        self._time.on_update(self._scrub)

    def _play_or_pause(self, _: Any) -> None:
        viewer = self._viewer
        if viewer.playing:
            viewer.playing = False
            self.follow()
        else:
            viewer.play()

    def _scrub(self, event: Any) -> None:
        """Shows the sample nearest to the time that was chosen by hand."""
        viewer = self._viewer
        if self._by_hand(event):
            viewer.playing = False
            viewer.show(int(np.argmin(np.abs(viewer.recorded.time - self._time.value))))

    def _show_worst(self, _: Any) -> None:
        self._viewer.playing = False
        self._viewer.show(self._viewer.recorded.worst_sample(self._viewer.shown.selected))

    # --------------------------------------------------------------------------------------------------------- readout

    def _add_joint(self, scene: Scene) -> None:
        names = [j.name for j in scene.joints]
        self._joints = dict(zip(labels(names, "joint"), names, strict=True))
        self._links = {label: OfLink(i) for i, label in enumerate(labels(scene.model.link_names, "link", ("joint", "world", "offset")))}
        links = list(self._links)
        selected = next(label for label, name in self._joints.items() if name == self._viewer.shown.selected)
        with self._gui.add_folder("Selected joint"):
            self._selected = self._gui.add_dropdown("joint", list(self._joints), initial_value=selected)
            self._part = self._gui.add_dropdown(
                "part",
                ["total", "constraint", "actuation"],
                initial_value="total",
                hint="What the structure carries, what acts along the joint's motion, or both",
            )
            self._axes = self._gui.add_dropdown("axes", ["joint", "world", *links], initial_value="joint")
            self._at = self._gui.add_dropdown(
                "point",
                ["joint", "world", "offset", *links],
                initial_value="joint",
                hint="That moments are about; offset: from the joint's origin, in its axes",
            )
            self._offset = self._gui.add_vector3("offset, m", (0.0, 0.0, 0.0), step=0.001, visible=False)
            self._on = self._gui.add_dropdown("acts on", ["child", "parent"], initial_value="child")
            self._readout = self._gui.add_markdown("")
        for control in (self._selected, self._part, self._axes, self._at, self._offset, self._on):
            control.on_update(self._choose)

    def _choose(self, _: Any) -> None:
        self._viewer.shown.selected = self._joints[self._selected.value]
        self._offset.visible = self._at.value == "offset"
        self._redraw()

    @property
    def choice(self) -> Choice:
        """How the readout expresses the wrench."""
        x, y, z = self._offset.value
        at: Any = (float(x), float(y), float(z)) if self._at.value == "offset" else self._links.get(self._at.value, self._at.value)
        return Choice(cast(Side, self._on.value), at, self._links.get(self._axes.value, cast(Any, self._axes.value)), cast(Part, self._part.value))

    def _text(self) -> str:
        viewer = self._viewer
        text = readout(viewer.scene, viewer.sample, viewer.shown.selected, self.choice)
        return text if viewer.scene.v.any() or viewer.scene.a.any() else f"{text}  \nat rest in this pose"

    # --------------------------------------------------------------------------------------------------------- toggles

    def _add_toggles(self, scene: Scene) -> None:
        shown, gui = self._viewer.shown, self._gui
        with gui.add_folder("Show"):
            names = {"moving joints": "moving", "selected joint": "", "all joints": "all", "no joint": "none"}
            at = gui.add_dropdown("wrenches of", list(names), initial_value="moving joints")

            @at.on_update
            def _(_: Any) -> None:
                self._only_selected = at.value == "selected joint"
                shown.wrenches = names[at.value] or shown.selected
                self._redraw()

            self._only_selected = False
            self._toggle("forces", "forces")
            self._toggle("moments", "moments")
            factor = gui.add_slider("length of arrows", 0.1, 5.0, step=0.1, initial_value=1.0)
            self._legend = gui.add_markdown(self._legend_text())

            @factor.on_update
            def _(_: Any) -> None:
                shown.arrow_factor = factor.value
                self._legend.content = self._legend_text()
                self._redraw()

            self._toggle("link and joint frames", "frames")
            self._toggle("joint axes and names", "joints")
            self._toggle("centre of mass", "centre_of_mass")
            if scene.placed:
                self._toggle("external wrenches", "external")
            self._toggle("screw axis of the selected joint's link", "screw_axis")
            colours = self._toggle("colours by utilisation", "utilisation")
            key = gui.add_markdown("  \n".join(_line(c, text) for c, text in utilisation_legend()) + "  \ngrey: no limit in the file", visible=False)

            @colours.on_update
            def _(_: Any) -> None:
                key.visible = colours.value

            for note in scene.look.notes[:5]:
                gui.add_html(f'<div style="{NOTE}">{html(note)}</div>')

    def _toggle(self, words: str, name: str) -> viser.GuiCheckboxHandle:
        shown = self._viewer.shown
        box = self._gui.add_checkbox(words, initial_value=getattr(shown, name))

        @box.on_update
        def _(_: Any) -> None:
            setattr(shown, name, box.value)
            self._redraw()

        return box

    def _legend_text(self) -> str:
        return "  \n".join(_line(c, text) for c, text in legend(self._viewer.scene, self._viewer.shown.arrow_factor))

    def _redraw(self) -> None:
        viewer = self._viewer
        with viewer.lock:
            if self._only_selected:
                viewer.shown.wrenches = viewer.shown.selected
            viewer.stage.show(viewer.scene, viewer.sample)
            self._readout.content = self._text()

    # --------------------------------------------------------------------------------------------------------- sliders

    def _add_sliders(self, scene: Scene) -> None:
        self._sliders: dict[int, Any] = {}
        self._led = led_coordinates(scene.model, scene.q[0]) if scene.model.loops else None
        with self._gui.add_folder("Joints"):
            for index, label, low, high in coordinates(scene, self._led):
                value = float(np.clip(scene.q[0, index], low, high))
                slider = self._gui.add_slider(label, low, high, step=max(1e-4, round((high - low) / 5000, 6)), initial_value=round(value, 6))
                self._sliders[index] = slider
                slider.on_update(self._pose_by_hand)
            if scene.model.loops:
                self._said = self._gui.add_html("")

    def _pose_by_hand(self, event: Any) -> None:
        if not self._by_hand(event):
            return
        with self._viewer.lock:
            q: Array = self._viewer.scene.q[self._viewer.sample].copy()
            for index, slider in self._sliders.items():
                if slider is event.target:
                    if self._led is not None:
                        self._lead(q, index, slider)
                        return
                    q[index] = slider.value
            self._viewer.update(q)

    def _lead(self, q: Array, index: int, slider: Any) -> None:
        """Moves a mechanism with loops as far as it follows a slider, and says why where it doesn't."""
        assert self._led is not None
        reached: Reached = moved_to(self._viewer.scene.model, q, index, float(slider.value), self._led)
        wanted = f"{slider.label}: {slider.value:.4g} is not reached ({reached.reason}); shown is the last closed position before it"
        self._viewer.update(reached.q)
        self._say("" if reached.reason == "closed" else wanted)

    def _say(self, text: str) -> None:
        """Below the sliders: what a slider did not reach, or why there are no wrenches."""
        said = text or self._viewer.scene.unloaded
        content = f'<div style="{NOTE}">{html(said)}</div>' if said else ""
        if self._said.content != content:
            self._said.content = content


def coordinates(scene: Scene, led: Collection[int] | None = None) -> list[tuple[int, str, float, float]]:
    """Index in q, label, and range of each number that a slider moves: all but quaternions; of mechanisms with loops those that are led.

    The limits of the file; where it gives none, a turn to either side, or the size of the scene.
    """
    from ksl.mechanism.joint_kinds import columns_of, units_of

    found = []
    for joint in scene.model.joints:
        columns = columns_of(joint)[0] if joint.nq else []
        for k, (column, unit) in enumerate(zip(columns, units_of(joint)[0])):
            if not unit:
                continue
            lower, upper = joint.limits[k] if k < len(joint.limits) else (None, None)
            reach = max(1.0, float(np.ceil(scene.size))) if unit == "m" else float(np.pi)
            low, high = -reach if lower is None else lower, reach if upper is None else upper
            if low < high and (led is None or joint.q_index + k in led):
                found.append((joint.q_index + k, f"{column}, {unit}", float(low), float(high)))
    return found


def _line(colour: tuple[int, int, int] | None, text: str) -> str:
    return text if colour is None else f'<span style="color:rgb{colour}">■</span> {text}'
