"""The calls of models that differentiate, for arrays of any library."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Generic, TypeAlias, TypeVar

from numpy.typing import ArrayLike

from ksl import _core
from ksl.base.other_names import unknown_call
from ksl.mechanism import given
from ksl.mechanism.chosen_coordinates import Chosen, coordinates_of
from ksl.model.model import Model
from ksl.mechanism.requests import one_of, request_of_frames, request_of_links, request_of_order
from ksl.mechanism.states import Acceleration, Expressed, ExternalAxes, Order, Part, Point, Side, Undetermined, external_in, items_of
from ksl.operators.operator import More, Operator, broadcast

_REQUESTS: dict[str, Callable[..., _core.Links | _core.Request | None]] = {
    "links": request_of_links,
    "frames": request_of_frames,
    "order": request_of_order,
    "joints": lambda model, *keywords: model.reaction_request(*keywords),
}

OPERATORS_KEPT = 1024
"""For one model; each holds a copy of it, some ten kilobytes."""

A = TypeVar("A")
"""Arrays of the library."""
Given: TypeAlias = "A | ArrayLike"
"""What calls take: these, which are differentiated, and numbers and arrays of NumPy, which are constants."""
Parameters: TypeAlias = "Given[A] | Mapping[str, Given[A]]"
"""Inertias of all links, or of some by their names."""


class Calls(ABC, Generic[A]):
    """Calls of a model that a library of arrays differentiates, in the forward and in the backward direction.

    They are those of :class:`ksl.Model` of the same names, with the same conventions, shapes and units.  Arguments are arrays of the library,
    float32 or float64, all of one type; leading shapes are broadcast.  One number stands for each coordinate: v=0.0.

    q is nq numbers, and results are functions of all of them: quaternions are divided by their length first, so that a gradient by a quaternion
    is at right angles to it.  :meth:`integrate` moves a position along a joint velocity instead.
    parameters: the inertial parameters (links, 10) of all links, in place of the model's, which `model.parameters` are; or (…, links, 10), a set for
    each state; or {link: (…, 10)} of some links, beside which the others have the model's.  They are differentiated, too.  Masses must not be
    negative; that the inertias are possible is not checked.
    NaN is passed on: a state that has one gives NaN, and the others don't notice.  So do numbers that are too large for the precision, as in functions of the
    library itself.

    external: {link name: (…, 6)}, wrenches on links, as :meth:`ksl.Model.inverse_dynamics` takes them; external_axes= too.  They are differentiated:
    efforts change by −Jᵀ times what a wrench changes by.

    Of a mechanism with loops, dynamics and reactions are those of the closed mechanism, whose states they take, and gradients are along it: the coordinates
    of :meth:`ksl.Model.independent` vary, and the gradient by those that follow is zero.  :meth:`close`, :meth:`consistent_velocity` and
    :meth:`consistent_acceleration` make closed states of driven coordinates.  States that are not closed raise :class:`ksl.ResultError`.

    Second derivatives: of inverse_dynamics, bias, gravity_torque, forward_dynamics and potential_energy, without parameters= and external=, of trees.  Asking
    for others raises NotImplementedError.
    """

    def __init__(self, model: Model, threads: int | None = None) -> None:
        if not isinstance(model, Model):
            raise TypeError(f"expected a ksl.Model, as ksl.load returns it, and not {type(model).__name__}")
        self.model = model
        self._threads = given.threads(threads)
        self._kept: dict[tuple[str, int, More], tuple[Operator, object]] = {}

    if not TYPE_CHECKING:  # otherwise a type checker would believe in any name

        def __getattr__(self, name: str) -> object:
            """Says which call is meant, and which ones a model alone has."""
            if name.startswith("_"):  # protocols of Python, and of libraries of arrays
                raise AttributeError(name)
            known = [own for own in dir(type(self)) if not own.startswith("_")]
            raise AttributeError(unknown_call(f"a {type(self).__name__}", "d", name, known, dir(Model)))

    def __reduce__(self) -> tuple[type[Calls[A]], tuple[Model, int]]:
        """Pickles and deep copies, of modules of torch that have one for example, are made anew from the model."""
        return type(self), (self.model, self._threads)

    @abstractmethod
    def _apply(self, operator: Operator, arguments: Sequence[Any]) -> A:
        """The result of an operator."""

    @abstractmethod
    def _is_differentiated(self, x: object) -> bool:
        """Does the library differentiate by this, or trace it?"""

    @abstractmethod
    def _array(self, x: Any, what: str) -> Any:
        """An array of the library, or of NumPy.  Raises ValueError for what holds no numbers; what: its name in the message."""

    @abstractmethod
    def _joined(self, name: str, wrenches: Mapping[str, Any]) -> Any:
        """Wrenches (…, 6) by what messages call them, in one array behind each other; their leading shapes are broadcast."""

    def _operator(
        self,
        name: str,
        external: tuple[str, ...],
        in_world: bool,
        parameters: bool,
        links: tuple[str, ...],
        nan_where_open: bool,
        make: str = "",
        *arguments: Any,
    ) -> Operator:
        """The operator, and its request by the function of `_REQUESTS` that makes it: once for the same request."""
        request = _REQUESTS[make](self.model, *arguments) if make in _REQUESTS else None
        given = tuple(coordinates_of(self.model, *arguments)) if make == "given" else ()
        more = More(external, in_world, parameters, tuple(self.model.link(link).name for link in links), given, nan_where_open)
        key = (name, id(request), more)
        if key not in self._kept:
            if len(self._kept) >= OPERATORS_KEPT:  # a point that changes from call to call; compiled programs of JAX keep theirs
                self._kept.clear()
            self._kept[key] = Operator(self.model, name, request, more, self._threads), request  # which keeps its id
        return self._kept[key][0]

    def _call(
        self, name: str, arguments: Sequence[Any], parameters: Any = None, request: Sequence[Any] = (), external: Mapping[str, Any] | None = None,
        axes: ExternalAxes = "link", nan_where_open: bool = False,
    ) -> A:  # fmt: skip
        external_in(None, axes)  # refuses other words
        links: tuple[str, ...] = ()
        if wrenches := items_of(external, axes):
            arguments = (*arguments, self._of_links(name, "external", wrenches))
        if isinstance(parameters, Mapping):
            if not (links := tuple(parameters)):
                raise ValueError(f"{name}: parameters names no link; expected {{link: (…, 10)}}, or leave it out")
            of_each = self._of_links(name, "parameters", parameters.items())
            parameters = of_each.reshape(*of_each.shape[:-1], len(links), 10)
        if parameters is not None:
            arguments = (*arguments, parameters)
        operator = self._operator(name, tuple(external or ()), axes == "world", parameters is not None, links, nan_where_open, *request)
        return self._apply(operator, arguments)

    def _of_links(self, name: str, kind: str, of_each: Iterable[tuple[str, Any]]) -> Any:
        """What links are given, behind each other."""
        arrays = {(what := f"{kind}[{link!r}]"): self._array(x, f"{name}: {what}") for link, x in of_each}
        _require_numbers(name, kind, arrays)
        return self._joined(name, arrays)

    def inverse_dynamics(
        self,
        q: Given[A],
        v: Given[A],
        a: Given[A],
        parameters: Parameters[A] | None = None,
        *,
        external: Mapping[str, Given[A]] | None = None,
        external_axes: ExternalAxes = "link",
    ) -> A:
        """Joint efforts (…, nv) that give accelerations a (…, nv) at q (…, nq) and v (…, nv); N m, N.

        As :meth:`ksl.Model.inverse_dynamics`.  Gradients by q, v and a: :meth:`ksl.Model.inverse_dynamics_gradient`, O(bodies); changes: Singh,
        Russell, Wensing (RA-L 7(2), 2022), O(bodies × depth); by parameters the regressor, O(links × depth).
        """
        return self._call("inverse_dynamics", (q, v, a), parameters, external=external, axes=external_axes)

    def bias(self, q: Given[A], v: Given[A], parameters: Parameters[A] | None = None) -> A:
        """Efforts (…, nv) that hold velocities v (…, nv) without acceleration; N m, N.  As :meth:`ksl.Model.bias`."""
        return self._call("bias", (q, v), parameters)

    def gravity_torque(self, q: Given[A], parameters: Parameters[A] | None = None) -> A:
        """Efforts (…, nv) that hold the mechanism at rest at q (…, nq); N m, N.  As :meth:`ksl.Model.gravity_torque`."""
        return self._call("gravity_torque", (q,), parameters)

    def forward_dynamics(
        self,
        q: Given[A],
        v: Given[A],
        tau: Given[A],
        parameters: Parameters[A] | None = None,
        *,
        external: Mapping[str, Given[A]] | None = None,
        external_axes: ExternalAxes = "link",
    ) -> A:
        """Accelerations (…, nv) under joint efforts tau (…, nv); rad/s², m/s².

        As :meth:`ksl.Model.forward_dynamics`.  Gradients by q, v and tau are those of inverse dynamics, at the accelerations found, times −M⁻¹: O(bodies);
        changes: Carpentier and Mansard (RSS 2018), O(nv² × depth); by parameters −M⁻¹ Y, Y being the regressor of inverse dynamics.
        """
        return self._call("forward_dynamics", (q, v, tau), parameters, external=external, axes=external_axes)

    def reactions(
        self, q: Given[A], v: Given[A], a: Given[A], parameters: Parameters[A] | None = None, *, on: Side = "child", at: Point = "joint", axes: str = "joint",
        order: Order = "lin_ang", part: Part = "total", joints: Iterable[str] | None = None, undetermined: Undetermined = "refuse",
    ) -> A:  # fmt: skip
        """The wrenches (…, joints, 6) through joints: what the parent side exerts on the child side; N, N m.

        on, at, axes, order, part, joints: as in :meth:`ksl.Model.reactions`.  Derivatives: after Singh, Russell, Wensing (RA-L 7(2), 2022),
        O(joints × nv); by parameters the regressor, O(joints × links).

        undetermined: what derivatives of components are that rigid bodies leave open in a mechanism with loops: "refuse", an error, which a
        gradient raises only where the component has a weight; or "nan".  Joints that close loops have derivatives at the joint in its axes.
        """
        one_of(undetermined, "undetermined", "refuse", "nan")
        if self._is_differentiated(at):
            raise TypeError("reactions: at is an array that is differentiated or traced, and there is no derivative by it; give three plain numbers")
        return self._call("reactions", (q, v, a), parameters, ("joints", on, at, axes, order, part, joints), nan_where_open=undetermined == "nan")

    def mass_matrix(self, q: Given[A]) -> A:
        """Mass matrix (…, nv, nv) at q (…, nq).  As :meth:`ksl.Model.mass_matrix`; its derivative costs O(nv × depth²)."""
        return self._call("mass_matrix", (q,))

    def kinetic_energy(self, q: Given[A], v: Given[A], parameters: Parameters[A] | None = None) -> A:
        """Kinetic energy (…), J: the first result of :meth:`ksl.Model.energy`."""
        return self._call("kinetic_energy", (q, v), parameters)

    def potential_energy(self, q: Given[A], parameters: Parameters[A] | None = None) -> A:
        """Potential energy (…), J, of gravity, and of springs if the model's physics has them: the second result of :meth:`ksl.Model.energy`."""
        return self._call("potential_energy", (q,), parameters)

    def frame_poses(self, q: Given[A], names: Iterable[str] | None = None) -> A:
        """Poses (…, names, 4, 4) of links' frames in the world; m.  As :meth:`ksl.Model.frame_poses`."""
        return self._call("frame_poses", (q,), request=("links", names))

    def frame_velocities(
        self, q: Given[A], v: Given[A], names: Iterable[str] | None = None, *, axes: Expressed = "frame", at: Expressed = "frame", order: Order = "lin_ang"
    ) -> A:
        """Twists (…, names, 6) of links' frames; m/s, rad/s.  As :meth:`ksl.Model.frame_velocities`."""
        return self._call("frame_velocities", (q, v), request=("frames", names, axes, at, order))

    def frame_accelerations(
        self, q: Given[A], v: Given[A], a: Given[A], names: Iterable[str] | None = None, *, kind: Acceleration = "spatial", axes: Expressed = "frame",
        at: Expressed = "frame", order: Order = "lin_ang",
    ) -> A:  # fmt: skip
        """Accelerations (…, names, 6) of links' frames, without gravity; m/s², rad/s².  As :meth:`ksl.Model.frame_accelerations`."""
        return self._call("frame_accelerations", (q, v, a), request=("frames", names, axes, at, order, None, kind))

    def center_of_mass(self, q: Given[A]) -> A:
        """Centre of mass (…, 3) in the world, m, of the links that move.  As :meth:`ksl.Model.center_of_mass`."""
        return self._call("center_of_mass", (q,))

    def centroidal_momentum(self, q: Given[A], v: Given[A], order: Order = "lin_ang") -> A:
        """Momentum (…, 6) about the centre of mass, in the world's axes; kg m/s, kg m²/s.  As :meth:`ksl.Model.centroidal_momentum`."""
        return self._call("centroidal_momentum", (q, v), request=("order", order))

    def centroidal_momentum_rate(self, q: Given[A], v: Given[A], a: Given[A], order: Order = "lin_ang") -> A:
        """Rate (…, 6) of the centroidal momentum; N, N m.  As :meth:`ksl.Model.centroidal_momentum_rate`."""
        return self._call("centroidal_momentum_rate", (q, v, a), request=("order", order))

    def integrate(self, q: Given[A], dv: Given[A]) -> A:
        """Positions q ⊕ dv (…, nq): where q (…, nq) is after unit time at the joint velocity dv (…, nv).  As :meth:`ksl.Model.integrate`."""
        return self._call("integrate", (q, dv))

    def difference(self, q0: Given[A], q1: Given[A]) -> A:
        """Differences q1 ⊖ q0 (…, nv): the joint velocity that leads from q0 to q1 in unit time.  As :meth:`ksl.Model.difference`."""
        return self._call("difference", (q0, q1))

    def close(self, q: Given[A], hold: Chosen) -> A:
        """The closed position (…, nq) of a mechanism with loops with the coordinates of the joints `hold` as in q (…, nq).

        As :meth:`ksl.Model.close`.  The other numbers of q say from where the search starts, and their gradient is zero.  The result is a function of
        those that are held, whose derivatives follow from the loops' equations; the joints must determine the position.  Where there is no
        closed position it is NaN; :meth:`ksl.Model.close` says why.

            q = d.close(start, hold=["crank"])
        """
        return self._call("close", (q,), request=("given", hold, "hold"))

    def consistent_velocity(self, q: Given[A], v: Given[A], given: Chosen) -> A:
        """Velocities (…, nv) that keep the loops closed at q (…, nq), with the coordinates of the joints `given` as in v (…, nv).

        As :meth:`ksl.Model.consistent_velocity`, with joints that determine the motion.  Gradients by q and v are by their coordinates.
        """
        return self._call("consistent_velocity", (q, v), request=("given", given, "given"))

    def consistent_acceleration(self, q: Given[A], v: Given[A], a: Given[A], given: Chosen) -> A:
        """Accelerations (…, nv) that keep the loops closed at q and v, with the coordinates of the joints `given` as in a (…, nv).

        As :meth:`ksl.Model.consistent_acceleration`, with joints that determine the motion.  Gradients by q, v and a are by their coordinates.
        """
        return self._call("consistent_acceleration", (q, v, a), request=("given", given, "given"))


def _require_numbers(name: str, kind: str, arrays: Mapping[str, Any]) -> None:
    """Raises ValueError for arrays that are no wrenches or parameters of a link, or don't fit each other."""
    shapes = {what: tuple(x.shape) for what, x in arrays.items()}
    leading: tuple[int, ...] = ()
    numbers, said = given.OF_LINKS[kind]
    for what, shape in shapes.items():
        if shape[-1:] != (numbers,):
            raise ValueError(f"{name}: {what} has shape {shape}; expected (…, {numbers}): {said}")
        leading = broadcast(leading, shape[:-1], name, list(shapes), list(shapes.values()))
