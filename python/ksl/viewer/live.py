"""The live page: a server of viser on this machine, with playback and controls."""

from __future__ import annotations

import os
import sys
import threading
import time as clock
import webbrowser
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.markup import html
from ksl.base.real_arrays import real_array
from ksl.mechanism.loops import one_position
from ksl.mechanism.requests import core_of
from ksl.mechanism.states import Array, External, argument_rows
from ksl.viewer.controls import Controls
from ksl.viewer.scene import Scene, make_scene, of_all
from ksl.viewer.shape_scene import scenes_of_modes
from ksl.viewer.scene_tree import Shown, Stage
from ksl.viewer.viser_server import start_server, stop_server

if TYPE_CHECKING:
    from ksl.mechanism.calls import Calls
    from ksl.model.poses_at_rest import Modes

FRAMES = 30
"""States that playback shows in a second."""


class Viewer:
    """A page that shows a scene, until it is closed or the program ends.  In a notebook it is shown in its place."""

    def __init__(self, scene: Scene, port: int | None = None, joint: str | None = None, scenes: Mapping[str, Scene] = MappingProxyType({})) -> None:
        """Starts the server, on 127.0.0.1.

        port: of the page; None takes 8080, or if that is in use a free one.  joint: the one that is selected first,
        by default that nearest to its limit.  scenes: of the same robot, {title: scene}, among which the page lets choose, `scene` being one of them; they
        are played again and again, from the start.  Raises ViewerError where the extra ksl[view] is missing, or the port is in use.
        """
        self.scene = self.recorded = scene
        self.sample = 0
        self.scenes = scenes
        self.playing = bool(scenes)
        self._closed = threading.Event()
        self.lock = threading.RLock()
        selected = joint if joint is not None else scene.worst_joint()
        scene.joint_index(selected)  # refuses unknown names before anything starts
        self.page_errors: list[str] = []
        """What went wrong in the page, as its browser says; also printed on standard error."""
        self.server, self._url = start_server(port, scene.model.name, self._page_failed)
        self.shown = Shown(selected=selected)
        self.stage = Stage(self.server, scene, self.shown)
        self.controls = Controls(self)
        self._thread = threading.Thread(target=self._play, name="ksl viewer", daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """Where a browser on this machine finds the page.  A token in it keeps others out."""
        return self._url

    def show(self, sample: int | None = None, scene: Scene | None = None) -> None:
        """Shows another state, of the recorded motion unless another scene of the robot is given."""
        with self.lock:
            self.scene = self.recorded if scene is None else scene
            self.sample = len(self.scene.time) - 1 if sample is not None and sample < 0 else min(sample or 0, len(self.scene.time) - 1)
            self.stage.show(self.scene, self.sample)
            self.controls.follow()

    def choose(self, title: str) -> None:
        """Plays another one of `scenes`."""
        with self.lock:
            self.recorded = self.scenes[title]
            self.playing = True
            self.show(0)

    def update(self, q: ArrayLike, v: ArrayLike | None = None, a: ArrayLike | None = None, external: External | None = None) -> None:
        """Shows another state (nq), at rest unless v and a (nv) are given; external wrenches stay those of the scene unless given."""
        wrenches: External = (
            {name: w[self.sample if self.scene is self.recorded else 0] for name, w in self.scene.external.items()} if external is None else external
        )
        self.playing = False
        self.show(0, make_scene(self.recorded.model, q, v, a, external=wrenches, look=self.recorded.look))

    def play(self, speed: float | None = None) -> None:
        """Plays the motion from the state that is shown, or from the start if that is the last; speed 1 is real time."""
        if speed is not None:
            self.controls.set_speed(speed)
        if self.scene is not self.recorded or self.sample == len(self.recorded.time) - 1:
            self.show(0)
        self.playing = len(self.recorded.time) > 1

    def open(self) -> bool:
        """Opens the page in the browser of this machine; false if there is none."""
        try:
            return webbrowser.open(self.url)
        except webbrowser.Error:
            return False

    def export(self, path: str | os.PathLike[str]) -> Path:
        """Writes the recorded scene into one file; see `ksl.viewer.export.export`."""
        from ksl.viewer.export import export

        return export(self.recorded, path, joint=self.shown.selected)

    def wait(self) -> None:
        """Returns when the viewer is closed, or at Ctrl-C."""
        try:
            while not self._closed.wait(0.2):
                pass
        except KeyboardInterrupt:
            self.close()

    def close(self) -> None:
        """Stops the server; pages that are open stay without one."""
        if not self._closed.is_set():
            self._closed.set()
            if threading.current_thread() is not self._thread:
                self._thread.join(2.0)  # it may be about to move something
            stop_server(self.server)

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<ksl.viewer.Viewer of {self.scene.model.name!r} at {self.url}>"

    def _repr_html_(self) -> str:
        return f'<iframe src="{html(self.url)}" title="{html(self.scene.model.name)}" style="width: 100%; height: 560px; border: 0"></iframe>'

    def _page_failed(self, said: str) -> None:
        if said not in self.page_errors:
            self.page_errors.append(said)
            print(f"ksl: the page in the browser reports an error: {said}", file=sys.stderr, flush=True)

    def _play(self) -> None:
        """Advances the playback.  Time is the clock's: a slow machine leaves out states, and doesn't slow the motion down."""
        last = clock.perf_counter()
        at = 0.0
        while not self._closed.wait(1 / FRAMES):
            now = clock.perf_counter()
            times = self.recorded.time
            if not self.playing:
                last, at = now, float(times[self.sample if self.scene is self.recorded else 0])
                continue
            at += (now - last) * self.controls.speed
            last = now
            sample = int(np.searchsorted(times, at, side="right")) - 1
            if sample >= len(times) - 1 and self.scenes:
                sample, at = 0, float(times[0])
            elif sample >= len(times) - 1:
                sample, self.playing = len(times) - 1, False
            if sample != self.sample or not self.playing:
                self.show(sample)


def show(
    model: Calls,
    q: ArrayLike | None = None,
    v: ArrayLike | None = None,
    a: ArrayLike | None = None,
    time: ArrayLike | None = None,
    external: External | None = None,
    *,
    joint: str | None = None,
    port: int | None = None,
    package_paths: Sequence[str | os.PathLike[str]] = (),
    browser: bool | None = None,
    modes: Modes | None = None,
) -> Viewer:
    """Opens a page that shows a model; see `Model.show`."""
    scenes: dict[str, Scene] = {}
    if modes is not None:
        given = {"v": v, "a": a, "time": time, "external": external}
        for name in (name for name, x in given.items() if x is not None):
            raise ValueError(f"{name} and modes: shapes of modes are shown about a pose at rest; leave out {name}")
        if q is None:
            raise ValueError("modes without q: give the pose that they are the modes of")
        scenes = scenes_of_modes(model, one_position(model, q), modes, package_paths)
    if time is not None and q is not None and (v is None or a is None):
        v, a = _differentiated(model, np.asarray(real_array(time, "time"), dtype=float), argument_rows(q, "q", model.nq, core_of(model)), v, a)
    scene = next(iter(scenes.values())) if scenes else make_scene(model, q, v, a, time, external, package_paths=package_paths)
    viewer = Viewer(scene, port, joint, scenes)
    if browser or (browser is None and not _in_notebook()):
        viewer.open()
    return viewer


def _differentiated(model: Calls, time: Array, q: Array, v: ArrayLike | None, a: ArrayLike | None) -> tuple[Array, Array]:
    """Velocities and accelerations of a motion, the missing ones from splines as in `Model.wrench_table`."""
    from ksl.base.errors import MotionError
    from ksl.motions.closed_motion import completed

    if time.ndim != 1 or q.shape != (len(time), model.nq):
        raise MotionError(f"time has shape {time.shape}, and q {q.shape}; expected (n) and (n, {model.nq})")
    if not len(time):
        raise MotionError(f"q has shape {q.shape}; expected one position, ({model.nq},), or (n, {model.nq}) with one or more")
    given = [None if x is None else of_all(argument_rows(x, name, model.nv, core_of(model)), name, len(time)) for x, name in ((v, "v"), (a, "a"))]
    joints = model.joints[: len(model.joint_names)]
    by_joint = [[None if x is None else x[:, j.v_index : j.v_index + j.nv] for x in given] for j in joints]
    motion = completed(model, time, q, by_joint, np.ones(model.nq, dtype=bool))
    return motion.v, motion.a


def _in_notebook() -> bool:
    """Whether a notebook shows what a cell returns."""
    import sys

    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return type(shell).__name__ == "ZMQInteractiveShell"
