"""A model: a mechanism with the calls of all algorithms."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol, cast

from numpy.typing import ArrayLike

from ksl import _core
from ksl.base.errors import DescriptionError
from ksl.base.files_read import InputFile, note, state_of
from ksl.base.higher_rooms import function_of
from ksl.mechanism import given
from ksl.mechanism.inverse_kinematics import InverseKinematicsCalls
from ksl.mechanism.payload import Payload, point_masses
from ksl.mechanism.requests import one_of
from ksl.simulation.simulate import SimulationCalls
from ksl.mechanism.states import EFFORT_PARTS, Array, External, ExternalAxes, Order, Point, Side
from ksl.model.on_card import CodeOnCard
from ksl.model.small_motions import SmallMotions
from ksl.model.surgery import Surgery

if TYPE_CHECKING:
    from ksl.base.arrow_table import ArrowTable
    from ksl.model.poses_at_rest import Modes
    from ksl.model.section import Share

Layout = Mapping[str, Any]
"""Where the numbers of each joint are in MuJoCo's arrays, for models read from MJCF; :mod:`ksl.robot_files.mjcf_states` reads them."""

_Arguments = tuple[str, bool, bool, bool, list[float] | None, list[tuple[str, float, list[float]]], bool, str, given.Physics, bool]
"""A path, and the options of `_core.load_text`: what a model is made from again."""


class ShownModel(Protocol):
    """What :meth:`Model.show` returns, for type checkers: a page that shows a model, until it is closed or the program ends (`ksl.viewer.live.Viewer`)."""

    @property
    def url(self) -> str:
        """Where a browser on this machine finds the page."""

    def update(self, q: ArrayLike, v: ArrayLike | None = None, a: ArrayLike | None = None, external: External | None = None) -> None:
        """Shows another state (nq), at rest unless v and a (nv) are given; external wrenches stay those of the scene unless given."""

    def play(self, speed: float | None = None) -> None:
        """Plays the motion from the state that is shown, or from the start if that is the last; speed 1 is real time."""

    def open(self) -> bool:
        """Opens the page in the browser of this machine; false if there is none."""

    def export(self, path: str | os.PathLike[str]) -> Path:
        """Writes what is shown into one file that opens offline."""

    def wait(self) -> None:
        """Returns when the page is closed, or at Ctrl-C."""

    def close(self) -> None:
        """Stops the server; pages that are open stay without one."""


class PartWrench(Protocol):
    """What acts on a free body at a point, for type checkers (`ksl.parts.free_body.PartWrench`)."""

    name: str
    kind: str
    point: Array
    wrench: Array
    undetermined: Any


class FreeBody(Protocol):
    """What :meth:`Model.free_bodies` returns for each link, for type checkers (`ksl.parts.free_body.FreeBody`)."""

    link: str
    links: tuple[str, ...]
    gravity: Array
    inertia: Array
    acceleration: Array
    angular_velocity: Array
    angular_acceleration: Array

    @property
    def wrenches(self) -> Sequence[PartWrench]: ...
    @property
    def complete(self) -> bool: ...
    @property
    def residual(self) -> Array: ...


class Model(Surgery, InverseKinematicsCalls, SimulationCalls, SmallMotions):
    """A mechanism, immutable.  Made by :func:`load`, by :class:`ksl.Builder`, or from another model by one of its methods.

    A pickle of a model that was loaded contains the arguments of `load`, with an absolute path.  Unpickling, for example in a
    worker of `multiprocessing`, reads the file again, and raises ValueError if its joints or links have changed.  A pickle of any
    other model contains all that the model is made of.  A copy, deep or not, is the model itself.
    """

    def __init__(
        self, core: _core.Model, arguments: _Arguments | None = None, layout: Layout | None = None, inputs: tuple[InputFile, ...] = (), payloads: tuple[Payload, ...] = ()
    ) -> None:  # fmt: skip
        if not isinstance(core, _core.Model):
            given_too = f"({core!r})" if isinstance(core, (str, os.PathLike)) else "(path)"
            said = f"ksl.load{given_too} reads a robot file, ksl.load_string(text) its contents, and ksl.Builder describes a robot in a program"
            raise TypeError(f"ksl.Model is not called with {type(core).__name__}: {said}")
        self._arguments, self._layout = arguments, layout
        super().__init__(core, inputs, payloads)

    if not TYPE_CHECKING:  # otherwise a type checker would believe in any name

        def __getattr__(self, name: str) -> object:
            """Says which call is meant, above all of names of other libraries."""
            if name.startswith("_") or "nv" not in self.__dict__:  # protocols of Python; models that are being made
                raise AttributeError(name)
            from ksl.base.other_names import unknown_call

            known = [own for own in (*dir(type(self)), *self.__dict__) if not own.startswith("_")]
            raise AttributeError(unknown_call("a ksl.Model", "m", name, known))

    def _made(self, core: _core.Model, inputs: tuple[InputFile, ...] | None = None, payloads: tuple[Payload, ...] | None = None) -> Model:
        return Model(core, inputs=self.inputs if inputs is None else inputs, payloads=self.payloads if payloads is None else payloads)

    def __copy__(self) -> Model:
        return self

    def __deepcopy__(self, _: object) -> Model:
        return self

    def __reduce__(self) -> tuple[Callable[..., Model], tuple[object, ...]]:
        if self._arguments is None:
            return _rebuilt, (self._core.state(), self._layout, self.inputs, self.payloads)
        return _reloaded, (self._arguments, self._fingerprint())

    def _fingerprint(self) -> str:
        """Differs between models that differ in joints, links, loops or drives."""
        import hashlib

        return hashlib.sha256(repr((self.joints, self.links, self.loops, self.drives, self.drive_weights)).encode()).hexdigest()

    def with_physics(self, physics: str | Iterable[str] | None, friction_width: float = 0.01) -> Model:
        """The same robot with this physics of joints, instead of its own.

        physics: names of what the file or the builder gives for joints and efforts are to include; None is none.

        * "damping": damping · v;
        * "friction": dry friction F by the smooth law F v / √(v² + w²), w being the joint's `friction_width` or else the one given here,
          rad/s or m/s; "exact friction": F sign(v), zero at rest, for inverse dynamics only: what solves or differentiates it is refused;
        * "armature": armature · a;
        * "rotor": the same with the inertia of the rotor times the gear ratio squared; "rotor bodies": each rotor is a body `JOINT_rotor` on
          the joint's parent link, about whose axis it turns `gear_ratio` times as fast as the joint, with gyroscopic effects;
        * "spring": stiffness · (q − rest);
        * "all": damping, friction, armature, rotor and spring.

        Efforts of inverse and forward dynamics are then those of the motors; :meth:`effort_parts` splits them.  Mass matrix, energies
        and derivatives follow.  What the robot has and the model doesn't apply is listed in `unused`.

            tau = m.with_physics(["damping", "friction"]).inverse_dynamics(q, v, a)
        """
        return Model(self._core.with_physics(given.physics(physics, friction_width)), layout=self._layout, inputs=self.inputs, payloads=self.payloads)

    def effort_part(
        self, q: ArrayLike, v: ArrayLike, a: ArrayLike, part: str = "motor", external: External | None = None, threads: int | None = None,
        external_axes: ExternalAxes = "link",
    ) -> Array:  # fmt: skip
        """One part (…, nv) of the efforts of motors, N m or N.

        part: "motor" is the whole, :meth:`inverse_dynamics`; "transmitted" the effort Sᵀ f along the joint's motion; "damping", "friction",
        "rotor" (armature and rotor) and "spring" what these need, zero unless the physics of the model names them.
        q, v, a, external, threads, external_axes: as in :meth:`inverse_dynamics`.
        """
        if one_of(part, "part", "motor", *EFFORT_PARTS) == "motor":
            return self.inverse_dynamics(q, v, a, external, threads=threads, external_axes=external_axes)
        return self.effort_parts(q, v, a, external, threads=threads, external_axes=external_axes)[..., EFFORT_PARTS.index(part), :]

    def section_wrench(
        self,
        q: ArrayLike,
        v: ArrayLike,
        a: ArrayLike,
        name: str,
        point: Sequence[float],
        normal: Sequence[float],
        share: Share = "body",
        beyond: Iterable[str] | None = None,
        external: External | None = None,
        axes: Literal["link", "world"] = "link",
        order: Order = "lin_ang",
        external_axes: ExternalAxes = "link",
    ) -> Array:
        """The wrench (…, 6) through a plane section of a link: what the near part exerts on the part beyond; N, N m.

        q (…, nq), v and a (…, nv): as in :meth:`inverse_dynamics`.  name: of the link that is cut.
        point, normal: of the plane, in the link's frame, m.  The normal points to the part beyond.  Moments are about the point.
        share: how much of the link's own inertia is beyond: "body" is all or nothing, by its centroid; a number is a fraction
        of its inertia; or (mass, first moment, inertia (3, 3)), both about the link's origin and in its axes.
        beyond: which joints of the link are beyond: of the joint that carries it, the joints that it carries, and those that close loops at it.
        By default those whose origins are; in the plane itself the first is near, and the others are beyond.
        external, external_axes: as in :meth:`inverse_dynamics`; a wrench on the link itself acts on the part with the link's own origin.
        axes: "link" or "world".  order: "lin_ang" or "ang_lin".

        Newton's and Euler's laws for the part beyond, with the reactions of its joints and the force elements whose points are beyond.
        O(bodies) for each joint beyond.

            cut = m.section_wrench(q, v, a, "forearm_link", point=(0, 0, 0.2), normal=(0, 0, 1))
        """
        from ksl.model.section import section_wrench

        return section_wrench(self, q, v, a, name, point, normal, share, beyond, external, axes, order, external_axes)

    def compile(
        self,
        algorithms: str | Sequence[str],
        scalar: Literal["double", "float"] = "double",
        external: Sequence[str] = (),
        compiler: str | None = None,
        device: str = "cpu",
        parameters: Sequence[str] = (),
    ) -> Model:
        """The same robot, whose batches of these algorithms are computed by code that is compiled for it alone.

        algorithms: as `ksl generate` takes them: ["inverse_dynamics", "jacobian:tool0", "reactions:elbow+base"]; links and joints by which a call
        asks, in its order.  All other calls, and calls that ask for something else, are computed as before.
        scalar: the precision of the arrays, "double" or "float".  Compile twice for both: the second model has the code of the first, too.
        external: links on which wrenches act in such calls, in this order; without any, calls with wrenches are computed as before.
        compiler: a command that takes the options of gcc; by default that of the variable KSL_CC, or clang, gcc, cc, or that of `ksl[compile]`.
        device: "cpu", or a graphics card, "cuda" or "cuda:1": calls with arrays on a card are then computed there, in the caller's current stream, without
        waiting, and others as before.  Takes tensors of torch, arrays of CuPy, Numba and others; results are of the first one's library, on its card.
        Products with derivatives are compiled by their names, "vjp.inverse_dynamics", for gradients of :func:`ksl.torch.differentiable` and
        :func:`ksl.jax.differentiable`; "simulate" compiles runs by semi-implicit Euler, "simulate:rk4" by rk4.  Needs `ksl[cuda]`; docs/card.md says what is checked there.
        parameters: links whose inertias such calls are given, parameters={link: (…, 10)}, for each state its own, or (10) for all: on a card alone.

        Results have the bits of the model's own, whatever the call; where fixed pivots of a closed mechanism don't serve, its own pivots are used.
        One state is computed as before.  Compiling takes a second or more, and pays from some ten million states on.  The code is kept in the user's
        cache folder, or in that of the variable KSL_CACHE, and is there for the next process.  A pickle has none.

        Raises ksl.CompilerError, and ArgumentError for what isn't compiled.

            fast = m.compile(["inverse_dynamics"])
            tau = fast.inverse_dynamics(q, v, a)
        """
        return cast("Model", function_of("compile")(self, algorithms, scalar, external, compiler, device, parameters))

    @property
    def compiled(self) -> tuple[str, ...]:
        """What :meth:`compile` was asked for."""
        return (*self._core.compiled(), *(function.asked for function in self._on_card.functions))

    def _repr_html_(self) -> str:
        """What a notebook shows: a picture of the mechanism, and its joints."""
        html: str = function_of("_repr_html_")(self)
        return html

    def wrench_table(
        self,
        time: ArrayLike,
        q: ArrayLike,
        v: ArrayLike | None = None,
        a: ArrayLike | None = None,
        *,
        external: External | None = None,
        on: Side = "child",
        at: Point = "joint",
        axes: str = "joint",
        order: Order = "lin_ang",
    ) -> ArrowTable:
        """Every wrench along a motion, as a table with a row for each sample and joint; see :func:`ksl.load_cases.wrench_table.wrench_table`.

        time (n), increasing, s; q (n, nq); v and a (n, nv) are differentiated from a quintic spline where they are missing.
        external: {link: (n, 6), or (6) for all samples}, or {link: ksl.Wrench}.  on, at, axes, order: as in :meth:`reactions`.
        Raises :class:`ksl.MotionError`.  Needs the extra `ksl[loads]`.

            table = m.wrench_table(time, q_over_time)
        """
        return cast("ArrowTable", function_of("wrench_table")(self, time, q, v, a, external=external, on=on, at=at, axes=axes, order=order))

    def free_bodies(
        self, q: ArrayLike, v: ArrayLike, a: ArrayLike, external: External | None = None, welded: Literal["together", "apart"] = "together",
        external_axes: ExternalAxes = "link",
    ) -> Mapping[str, FreeBody]:  # fmt: skip
        """Each link with everything that acts on it, {link: free body}: a self-equilibrated load case of the part that it is.

        q (nq), v and a (nv), external, external_axes: of one state, as in :meth:`inverse_dynamics`.
        welded: links that are welded are one body "together", under the name of the topmost; "apart" each is one, and the welds are joints.

        A free body (`ksl.parts.free_body.FreeBody`) has `wrenches`, each with name, kind, point and wrench: of joints, also those that close loops,
        payloads, external wrenches and force elements; `gravity` and `inertia` of the body itself; its acceleration, angular velocity and
        angular acceleration; `residual`, their sum, which is round-off; and `complete`, false where rigid bodies leave components open.
        Springs and drives of joints are inside the joint's wrench.  All is in the link's axes, N, N m, m; moments are about each wrench's point.
        O(links).  :func:`ksl.free_bodies` chooses instants of a motion.

            on = m.free_bodies(q, v, a)["forearm_link"].wrenches
        """
        return cast("Mapping[str, FreeBody]", function_of("free_bodies")(self, q, v, a, external, welded, external_axes))

    def actuation(
        self, joints: Iterable[str], start: ArrayLike | None = None, ball_limits: Mapping[str, float] | None = None, sharing: str | None = None
    ) -> Any:
        """The map between what motors do and what these joints do, through the rods and cranks between them; see :func:`ksl.actuation`.

        joints: names, in the order of the columns of its arrays.  start (nq): a closed position on the assembly that is meant, by default the
        closed one nearest to neutral.  ball_limits: {joint: angle}, rad, by which rods swing at most in balls at their ends.
        sharing: "limits" or "weights", how motors that are more than the joints share efforts.  Raises ValueError for joints that no motor moves, or that are not as many as the freedoms.  The result is a
        `ksl.Actuation`, as editors see it of `ksl.actuation(m, joints)`.

            a = m.actuation(["ankle_pitch", "ankle_roll"])
            tau_motors = a.motor_efforts(q, v, a)
        """
        return function_of("actuation")(self, joints, start, ball_limits, sharing)

    def show(
        self,
        q: ArrayLike | None = None,
        v: ArrayLike | None = None,
        a: ArrayLike | None = None,
        time: ArrayLike | None = None,
        external: External | None = None,
        *,
        joint: str | None = None,
        port: int | None = None,
        package_paths: Sequence[str] = (),
        browser: bool | None = None,
        modes: Modes | None = None,
    ) -> ShownModel:
        """Shows the robot with the wrenches at its joints in a page on this machine, and returns a handle of it at once.

        q (nq), or (n, nq) with time (n), s, for playback; by default a pose within the limits.  v and a (…, nv): differentiated from
        q and time where they are missing, which needs the extra `ksl[loads]`; of a single pose zero.
        external: {link: (6) or (n, 6)}, at the link's origin, in its axes.  joint: the one that is selected first.
        port: of the page, on 127.0.0.1; None is 8080 or a free one.  package_paths: folders with the packages of `package://` meshes.
        modes: of :meth:`modes` at q: their shapes sway about it, one after the other as the page chooses; v, a, time and external are then left out.
        browser: whether a browser is opened; None: in scripts, but not in notebooks, which show the page in place of the handle.

        The handle has `url`, `update(q)`, `play()`, `export("file.html")`, `wait()`, which keeps a script running until Ctrl-C, and `close()`.
        Needs the extra `ksl[view]`.  Raises ViewerError, and ValueError for what doesn't fit the model.
        """
        shown: ShownModel = function_of("show")(
            self, q, v, a, time, external, joint=joint, port=port, package_paths=package_paths, browser=browser, modes=modes
        )
        return shown


def with_code(model: Model, code: list[tuple[str, str, Any, list[int], bool, int, int, int]]) -> Model:
    """The same model with compiled functions: words, row, request, links with wrenches, single precision, lanes, bytes of memory, address."""
    return with_card(model._with_core(model._core.with_code(code), model._arguments), model._on_card)


def with_card(model: Model, code: CodeOnCard) -> Model:
    """A model with this code for graphics cards, in place of what it has."""
    made = model._with_core(model._core, model._arguments)
    made.__dict__.update(code.calls(made), _on_card=code)
    return made


def code_on_card(model: Model) -> CodeOnCard:
    """What it has of code for graphics cards."""
    return model._on_card


def layout_of(model: Model) -> Layout | None:
    """Where the numbers of each joint are in MuJoCo's arrays; None for models that were not read from MJCF."""
    return model._layout


def sealed(model: Model) -> tuple[str, bytes]:
    """SHA-256 of all that a model is made of, the same in every process, and a pickle that contains all of it, and no file."""
    import hashlib
    import pickle

    state = model._core.state()
    said = hashlib.sha256(repr(state).encode()).hexdigest()
    return said, pickle.dumps(_rebuilt(state, model._layout, payloads=model.payloads), protocol=4)


def _rebuilt(state: list[Any], layout: Layout | None = None, inputs: tuple[InputFile, ...] = (), payloads: tuple[Payload, ...] = ()) -> Model:
    return Model(_core.Model.from_state(state), layout=layout, inputs=inputs, payloads=payloads)


def hashed(file: str, contents: bytes) -> tuple[InputFile, ...]:
    """The file that a model was read from, and the hash of what was read."""
    import hashlib

    found = InputFile("robot", file, hashlib.sha256(contents).hexdigest() if state_of(file) is not None else None)
    note(found, DescriptionError)
    return (found,)


def _reloaded(arguments: _Arguments, fingerprint: str) -> Model:
    """Loads the model of a pickle, without warnings, which were given when it was first loaded."""
    name = os.fsencode(arguments[0])
    contents = _core.file_bytes(name)
    model = Model(_core.load_text(contents, name, *arguments[1:]), arguments, inputs=hashed(arguments[0], contents), payloads=point_masses(arguments[5]))
    if model._fingerprint() != fingerprint:
        raise ValueError(f"{model.file}: joints or links have changed since the model was pickled; load the file again")
    return model
