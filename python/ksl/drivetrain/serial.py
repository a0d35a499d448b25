"""The open tree that stands for a closed mechanism in simulators: its masses, armature and limits.

Rods and cranks are cut off.  Their masses become points on the links that are left, chosen among places of rods, cranks and their ends, such that
mass and centre at `at` are exact and efforts over the range are best; the armature of each joint is what the diagonal of the mass matrix lacks.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from ksl.drivetrain.assembly import positions_of
from ksl.drivetrain.efforts import EffortMap, Limited
from ksl.drivetrain.least_squares import not_negative
from ksl.drivetrain.motion import Carrier
from ksl.drivetrain.region import usable_positions, usable_ranges
from ksl.drivetrain.rods_cut import RodsCut
from ksl.mechanism.requests import one_of
from ksl.mechanism.states import Array
from ksl.robot_files.loading import load_string

if TYPE_CHECKING:
    from ksl.model.model import Model

Limits = Literal["safe", "mean"]
SAMPLES, SPEED, RATE, ARM = 240, 1.0, 30.0, 0.1
"""States for which efforts are best: positions over the range, velocities of this size, rad/s, and accelerations, rad/s²; times this, m, where joints slide."""


@dataclass(frozen=True)
class SerialErrors:
    """By how much efforts at the joints differ from those of the closed mechanism, N m or N; each (joints)."""

    largest: Array
    mean: Array
    """The mean of the magnitudes."""
    root_mean_square: Array
    naive_largest: Array
    """The tree whose rods and cranks are cut off has these."""
    naive_mean: Array
    naive_root_mean_square: Array


def serial_model(a: EffortMap, whole: EffortMap, at: ArrayLike | None, limits: Limits) -> Model:
    """As :meth:`ksl.Actuation.serial_model`; whole: the map with rotors."""
    one_of(limits, "limits", "safe", "mean")
    if several := [name for name in a.joints if a.model.joint(name).nv > 1]:
        raise ValueError(
            f"joint {several[0]!r} is {a.model.joint(several[0]).kind}, and its armature would be one number for all its coordinates; describe it by hinges for a serial model"
        )
    m, cut, q = a.model, a.rods_cut, place_of(a, at)
    target = np.diag(np.asarray(cut.without_rods.mass_matrix(a.state(q)[0]))[np.ix_(*[a.equations.part.of_joints] * 2)]) + np.diag(a.reflected_inertia(q))
    samples = usable_positions(a, q, SAMPLES)
    masses = _Masses(whole, cut, q, samples)
    tree = cut.tree.with_parameters(masses.parameters())
    armature = target - np.diag(np.asarray(tree.mass_matrix(a.state(q)[0]))[np.ix_(*[a.equations.part.of_joints] * 2)])
    text = _edited(a, tree.to_urdf(), dict(zip(a.joints, np.maximum(armature, 0.0).tolist())), _limits(a, q, samples, limits))
    physics = [name for name in m.physics if name != "rotor bodies"] + (["rotor"] if "rotor bodies" in m.physics else []) + ["armature"]
    floats = "floating_base" in m.joint_names and all(
        element.get("name") != "floating_base" for element in ET.fromstring(text).iter("joint")
    )  # an SDF file has it as a joint
    return load_string(text, floating_base=floats, gravity=m.gravity.tolist(), physics=list(dict.fromkeys(physics)), friction_width=m.friction_width)


def serial_errors(a: EffortMap, whole: EffortMap, serial: Model, states: Carrier, carrier: Carrier | None) -> SerialErrors:
    """As :meth:`ksl.Actuation.serial_errors`; whole: the map with rotors; states: q, v and a of the joints."""
    q, v, acceleration = states
    Q, V, A = (np.atleast_2d(x) for x in a.state(q, v, acceleration, carrier))
    own = [joint.v_index for name in a.joints for joint in [serial.joint(name)]]
    of_tree = [np.zeros((len(Q), serial.nq)), np.zeros((len(Q), serial.nv)), np.zeros((len(Q), serial.nv))]
    for joint in serial.joints:
        if joint.nv:
            of = a.model.joint(joint.name)
            of_tree[0][:, joint.q_index : joint.q_index + joint.nq] = Q[:, of.q_index : of.q_index + of.nq]
            for to, x in ((of_tree[1], V), (of_tree[2], A)):
                to[:, joint.v_index : joint.v_index + joint.nv] = x[:, of.v_index : of.v_index + of.nv]
    lost = np.atleast_2d(a.static_joint_efforts(q, whole.lost_efforts(q, v, acceleration, carrier)))
    true = np.atleast_2d(a.static_joint_efforts(q, whole.motor_efforts(q, v, acceleration, carrier)))
    errors = np.asarray(serial.inverse_dynamics(of_tree[0], of_tree[1], of_tree[2]))[:, own] - true
    return SerialErrors(*(f(np.abs(x)) for x in (errors, lost) for f in (_largest, _mean, _rms)))


def _largest(x: Array) -> Array:
    return np.asarray(x.max(axis=0))


def _mean(x: Array) -> Array:
    return np.asarray(x.mean(axis=0))


def _rms(x: Array) -> Array:
    return np.asarray(np.sqrt((x**2).mean(axis=0)))


def place_of(a: EffortMap, at: ArrayLike | None) -> Array:
    """One position (joints); that of the start for None.  Raises ValueError for one out of reach, and beyond where motors hold nothing."""
    q = a.start[positions_of(a.equations, a.equations.part.of_joints)] if at is None else np.asarray(at, dtype=float)
    if q.shape != (len(a.equations.part.of_joints),):
        raise ValueError(f"at has shape {q.shape}; expected one position, ({len(a.equations.part.of_joints)},)")
    start, here = (float(a.holding(a.motor_jacobian(x))) for x in (a.start[positions_of(a.equations, a.equations.part.of_joints)], q))
    if here / start <= 0:
        raise ValueError(f"at={q.tolist()}: motors pull the other way there than at the start, beyond where they hold nothing; range(joint) says where that is")
    return q


class _Masses:
    """Points on the links that are left: where they may be, and the masses that are best."""

    def __init__(self, a: EffortMap, cut: RodsCut, q: Array, samples: Array) -> None:
        self.a, self.cut, self.q = a, cut, q
        self.Q = a.state(q)[0]
        m = a.model
        self.samples = samples
        self.named = named = [m.joint(name) for name in a.joints]
        parents = [joint.parent for joint in named] + [m.joint(name).parent for name in cut.joints]
        self.links = [link for link in dict.fromkeys([*parents, *(joint.child for joint in named)]) if link is not None and link not in cut.links]
        self.bodies = [m.link(name) for name in cut.links if m.link(name).mass > 0]

    def parameters(self) -> dict[str, Array]:
        """{link: ten numbers}, with the points, of the links that carry some."""
        m = self.a.model
        found: dict[str, Array] = {link: np.zeros(10) for link in self.cut.links}
        if not self.bodies:
            return found
        places = self._places()
        on = [(link, _in_frame(m.frame_pose(self.Q, link), x)) for link in self.links for x in places]
        start = np.zeros(len(on))
        start[: len(self.bodies)] = [body.mass for body in self.bodies]  # the first places are their centres, the first link what carries the mechanism
        masses = self._best(on, start, np.array([x for _ in self.links for x in places]))
        ten: dict[str, Array] = {link: np.array(m.link(link).parameters) for link in self.links}
        for (link, x), mass in zip(on, masses):
            if mass > 0:
                ten[link] += mass * _point(x)
        return found | ten

    def _places(self) -> list[Array]:
        """In the world at `at`: centres of rods and cranks, and the frames of their joints and loops."""
        m, Q = self.a.model, self.Q
        poses = {link.name: m.frame_pose(Q, link.name) for link in m.links}
        centres = [poses[body.name][:3, :3] @ (np.array(body.first_moment) / body.mass) + poses[body.name][:3, 3] for body in self.bodies]
        joints = [poses[joint.child][:3, 3] for joint in m.joints if joint.name in self.cut.joints]
        loops = [(poses[loop.successor] @ np.reshape(loop.successor_pose, (4, 4)))[:3, 3] for loop in self.a.equations.part.loops]
        return [*centres, *joints, *loops]

    def _best(self, on: list[tuple[str, Array]], start: Array, places: Array) -> Array:
        a, own = self.a, self.a.equations.part.of_joints
        rng = np.random.default_rng(1)
        q, slides = self.samples, np.array([ARM if joint.unit == "m" else 1.0 for joint in self.named])
        v, acceleration = (size * slides * rng.normal(size=q.shape) for size in (SPEED, RATE))
        lost = a.static_joint_efforts(q, a.lost_efforts(q, v, acceleration))
        columns = self._efforts(on, *a.state(q, v, acceleration))[:, own]
        zero = np.zeros(self.a.model.nv)
        diagonal = np.stack([self._efforts(on, self.Q, zero, np.eye(len(zero))[i])[0, i] - self._efforts(on, self.Q, zero, zero)[0, i] for i in own])
        inertia = np.diag(a.reflected_inertia(self.q))
        A = columns - diagonal * acceleration[..., None]
        b = lost - inertia * acceleration
        size = _rms(lost)
        weights = 1.0 / np.maximum(size, 1e-9 * (size.max() or 1.0))  # of efforts in N and in N m
        whole, apart = start.sum(), places - places.mean(axis=0)
        A, b = A * (whole * weights[:, None]), b * weights  # a watch and a crane have the same numbers: shares of the mass, and of the length
        equal = np.vstack([np.ones(len(on)), apart.T / (np.abs(apart).max() or 1.0)])
        shares = not_negative(A.reshape(-1, len(on)), b.ravel(), equal, equal @ (start / whole))
        masses = None if shares is None else whole * shares
        fits = masses is not None and bool((diagonal @ masses <= inertia).all())  # otherwise an armature would be negative
        return masses if masses is not None and fits else start

    def _efforts(self, on: list[tuple[str, Array]], Q: Array, V: Array, A: Array) -> Array:
        """Efforts (n, nv, points) that a point of 1 kg needs."""
        Y = np.asarray(self.cut.tree.inverse_dynamics_regressor(np.atleast_2d(Q), np.atleast_2d(V), np.atleast_2d(A), links=self.links))
        Y = Y.reshape(len(Y), Y.shape[1], len(self.links), 10)
        return np.stack([Y[:, :, self.links.index(link)] @ _point(x) for link, x in on], axis=-1)


def _in_frame(pose: Array, x: Array) -> Array:
    return np.asarray(pose[:3, :3].T @ (x - pose[:3, 3]))


def _point(x: Array) -> Array:
    """The ten numbers of 1 kg at a point: m, m c, Ixx, Ixy, Iyy, Ixz, Iyz, Izz."""
    a, b, c = x
    return np.array([1.0, a, b, c, b * b + c * c, -a * b, a * a + c * c, -a * c, -b * c, a * a + b * b])


def _limits(a: EffortMap, at: Array, q: Array, how: Limits) -> dict[str, dict[str, float]]:
    """{joint: attributes of its <limit>}.  The safe ones hold at all positions of the range together; limits of motors that are missing give none."""
    ends = usable_ranges(a, at)
    found: dict[str, dict[str, float]] = {name: {"lower": float(low), "upper": float(high)} for name, (low, high) in zip(a.joints, ends)}
    boxes: list[tuple[Limited, Callable[[Array], Array]]] = [("effort", a.effort_box), ("velocity", a.velocity_box)]
    for what, box in boxes:
        if a.has_limits(what):
            half = np.asarray(box(q))[..., 1]
            for name, x in zip(a.joints, half.min(axis=0) if how == "safe" else half.mean(axis=0)):
                found[name][what] = float(x)
    return found


def _edited(a: EffortMap, text: str, armature: dict[str, float], limits: dict[str, dict[str, float]]) -> str:
    """The URDF text without rods and cranks, with armature, damping and limits of the joints."""
    cut = a.rods_cut
    robot = ET.fromstring(text)
    for tag, gone in (("joint", {*cut.joints}), ("link", {*cut.links})):
        for element in robot.findall(tag):
            child = element.find("child")
            if element.get("name") in gone or (child is not None and child.get("link") in cut.links):
                robot.remove(element)
    for element in robot.findall("transmission"):
        robot.remove(element)
    damping = a.reflected_damping()
    for element in robot.findall("joint"):
        name = element.get("name", "")
        if name in armature:
            for tag in ("limit", "dynamics"):
                for old in element.findall(tag):
                    element.remove(old)
            given = {key: x for key, x in limits[name].items() if element.get("type") != "continuous" or key not in ("lower", "upper")}
            ET.SubElement(element, "limit", {key: repr(x) for key, x in ({"effort": 0.0, "velocity": 0.0} | given).items()})
            ET.SubElement(element, "dynamics", {"armature": repr(armature[name]), "damping": repr(damping[name])})
    return ET.tostring(robot, encoding="unicode")
