"""MJCF files, read through the package `mujoco`.

`ksl.load` reads MJCF: MuJoCo's compiler resolves defaults and computes inertias from geometry, and its result becomes a model.
"""

from __future__ import annotations

import importlib.util
import os
import re
import warnings
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from ksl.base.errors import DescriptionError, DescriptionWarning
from ksl.base.files_read import InputFile
from ksl.base.words import listed
from ksl.model.builder import Builder, core_of_builder
from ksl.mechanism.core_sentences import with_file
from ksl.mechanism.joint_kinds import KINDS, Kind
from ksl.robot_files.mjcf_compiler import Refused, compiled
from ksl.robot_files.mjcf_amounts import too_much
from ksl.robot_files.mjcf_files import FilesOfMjcf
from ksl.robot_files.mjcf_frames import matrix, moved
from ksl.robot_files.mjcf_frames import pose as frame
from ksl.robot_files.mjcf_actuators import actuated, actuator_count, added, effort_ranges, is_off, led, limit_of
from ksl.robot_files.mjcf_loops import (
    KINDS_OF_EQUALITY,
    Coupling,
    check_kinds,
    closures,
    common_name,
    coupled_joints,
    couplings,
    drives,
    handles,
    is_active,
    is_of_handle,
    name_of,
)
from ksl.robot_files.mjcf_tendons import add_force_elements
from ksl.robot_files.read_options import ReadOptions
from ksl.model.model import Model
from ksl.mechanism.requests import one_of

Array = NDArray[np.float64]

FREE, BALL, SLIDE, HINGE = range(4)
"""Values of mjtJoint, which MuJoCo publishes."""
OF_MUJOCO = {FREE: KINDS["floating"], BALL: KINDS["spherical"], SLIDE: KINDS["prismatic"], HINGE: KINDS["revolute"]}
"""Kinds of joints that are those of MuJoCo."""
GRAVITY_DISABLED = 1 << 7
"""The bit of mjtDisableBit that turns gravity off."""
CLOSE = 1e-12
"""Axes and positions that differ less are the same: MuJoCo's compiler normalises axes."""


def model_of(
    mj: Any,
    file: str = "",
    mimic: Literal["coupled", "independent"] = "coupled",
    strict: bool = False,
    masses: Literal["optional"] | None = None,
    loops: Literal["cut"] | None = None,
) -> Model:
    """The model of a compiled `mujoco.MjModel`.

    mimic, strict, masses, loops: as in :func:`ksl.load`.  file: what messages call it; nothing is read.  Raises :class:`ksl.DescriptionError`.
    """
    if not (hasattr(mj, "nbody") and hasattr(mj, "nq")):
        raise ValueError(f"mj is {type(mj).__name__}; expected a mujoco.MjModel, for example MjModel.from_xml_path(file)")
    if loops is not None:
        one_of(loops, "loops", "cut")
    model = _model(mj, file, ReadOptions(mimic=mimic, strict=strict, masses=masses, loops=loops), [])
    for line in model.warnings:
        warnings.warn(line, DescriptionWarning, stacklevel=2)
    return model


def _load(file: str, text: bytes | None, contents: bytes, options: ReadOptions) -> Model:
    if importlib.util.find_spec("mujoco") is None:
        raise DescriptionError(f"{file}: this is MJCF, which is read by the package mujoco; install it with: pip install 'ksl[mjcf]'")
    if text is None and not _is_utf_8(file):
        readable = os.fsencode(file).decode("utf-8", "backslashreplace")
        raise DescriptionError(f"{readable}: MuJoCo reads only paths in UTF-8; rename the file or its folder")
    said: list[str] = []
    files = FilesOfMjcf(file, contents, text is not None)
    if asks := too_much(files.amounts):
        raise DescriptionError(f"{file}: {_one_line(asks)}")
    try:
        mj = compiled(
            os.fspath(file), None if text is None else text.decode("utf-8", "replace"), lambda line: said.append(f"MuJoCo's compiler says: {_one_line(line)}")
        )
    except Refused as e:
        raise DescriptionError(f"{file}: MuJoCo's compiler refuses the file: {_one_line(e)}; correct it there") from None
    return _model(mj, file, options, said, files.inputs(DescriptionError))


def _is_utf_8(path: str) -> bool:
    try:
        path.encode()
    except UnicodeEncodeError:
        return False
    return True


def _model(mj: Any, file: str, options: ReadOptions, said: list[str], inputs: tuple[InputFile, ...] = ()) -> Model:
    try:
        with np.errstate(all="ignore"):  # numbers beyond the range, which the builder refuses
            reader = _Reader(mj, options.mimic_independent, options.cut_loops)
            core_of_builder(reader.builder).read_from(file, reader.unused_lines(), [*said, *reader.said])
            if options.floating_base and not (mj.jnt_type == FREE).any():
                raise DescriptionError("a floating base is asked for, but no body has a <freejoint>; add one, or don't ask for that")
            core = core_of_builder(reader.builder).build(False, *options.of_builder())
    except ValueError as e:
        fault = ValueError("a name in it is not UTF-8; save the file in UTF-8, or give other names") if isinstance(e, UnicodeDecodeError) else e
        raise DescriptionError(with_file(file, fault)) from None
    return Model(core, layout=reader.layout, inputs=inputs, payloads=options.carried)


class _Reader:
    """Bodies, joints and sites of a compiled MuJoCo model as links and joints."""

    def __init__(self, mj: Any, independent: bool, cut: bool) -> None:
        self.mj, self.cut = mj, cut
        self.said: list[str] = []
        self.layout: dict[str, Any] = {"nq": int(mj.nq), "nv": int(mj.nv), "joints": {}}
        gravity = np.zeros(3) if mj.opt.disableflags & GRAVITY_DISABLED else mj.opt.gravity
        self.builder = Builder(bytes(mj.names).split(b"\0", 1)[0].decode() or "mujoco", gravity=tuple(map(float, gravity)))
        self.names: dict[str, set[str]] = {"link": set(), "joint": set()}
        self.unused: dict[str, list[str]] = {}
        self.carried: set[int] = set()
        """Equality constraints that the model has."""
        self.coupled = {j for i in range(mj.neq) for j in coupled_joints(mj, i)}
        self.bodies = [self.new("link", mj.body(i).name or ("world" if i == 0 else f"body{i}")) for i in range(mj.nbody)]
        self.joints = [self.new("joint", mj.joint(i).name or f"{self.bodies[mj.jnt_bodyid[i]]}_joint") for i in range(mj.njnt)]
        self.held: dict[int, float] = {}
        """Joints that equality constraints hold, and where."""
        self.followers: dict[int, Coupling] = {} if independent else couplings(mj, self.joints, self.carried, self.held)
        self.handles = handles(mj)
        if not cut:
            check_kinds(mj)
        self.closures = [] if cut else closures(mj, self.carried, self.handles, self.said.append)
        self.driven = {j for i in range(actuator_count(mj)) for j in actuated(mj, i)} - set(self.held)
        self.efforts = self.effort_limits()
        self.own = {what: getattr(mj, f"dof_{what}") + added(mj, what) for what in ("damping", "armature")} | {"frictionloss": mj.dof_frictionloss}
        """Damping, armature and friction of each coordinate, with what actuators add."""
        self.builder.add_link(self.bodies[0])
        for i in range(1, mj.nbody):
            if i not in self.handles:
                self.add_body(i)
        self.say_handles()
        if pulled := [self.bodies[i] for i in np.flatnonzero(mj.body_plugin >= 0)]:
            self.said.append(f"a plugin acts on body {listed(pulled, 6)}, with forces that KSL doesn't read: they are missing")
        self.add_sites()
        self.add_loops()
        self.force_elements, self.of_tendons = add_force_elements(self.builder, mj, self.bodies, self.joints, self.handles, self.said.append)

    def new(self, of: str, name: str) -> str:
        """A name that no other link or joint has."""
        while name in self.names[of]:
            name += "_"
        self.names[of].add(name)
        return name

    def add_body(self, i: int) -> None:
        mj, R = self.mj, matrix(self.mj.body_iquat[i])
        self.builder.add_link(self.bodies[i], float(mj.body_mass[i]), mj.body_ipos[i], _symmetric((R * mj.body_inertia[i]) @ R.T))
        parent, pose = self.bodies[mj.body_parentid[i]], frame(mj.body_quat[i], mj.body_pos[i])
        joints = list(range(mj.body_jntadr[i], mj.body_jntadr[i] + mj.body_jntnum[i]))
        if not joints:
            self.weld(self.bodies[i], parent, pose)
        elif (kind := self.kind_of(joints)) is not None:
            self.add_joint_of_kind(kind, joints, parent, i, pose)
        else:
            self.add_chain(joints, parent, i, pose)

    def weld(self, link: str, parent: str, pose: Array) -> None:
        self.builder.add_joint(self.new("joint", f"{link}_joint"), "fixed", parent, link, pose)

    def kind_of(self, joints: list[int]) -> Kind | None:
        """The kind of several joints in one body that has exactly their motion and all that is said of them; None otherwise."""
        mj = self.mj
        types = [int(mj.jnt_type[j]) for j in joints]
        if len(joints) == 1 or any(t in (FREE, BALL) for t in types):
            return None
        qs, vs = [mj.jnt_qposadr[j] for j in joints], [mj.jnt_dofadr[j] for j in joints]
        moved = np.abs([mj.jnt_pos[j] for j, t in zip(joints, types) if t == HINGE]).max(initial=0.0) > CLOSE
        # a kind has neither limits nor springs of single coordinates, and one number for the losses of all, which are of one unit
        named = any(mj.jnt_limited[j] or j in self.efforts or mj.jnt_stiffness[j] or j in self.coupled for j in joints)
        mixed = len(set(types)) > 1
        named = named or (bool(self.closures) and 0 < len(self.driven.intersection(joints)) < len(joints))  # motors move whole joints
        unequal = any(x[vs].any() if mixed else np.ptp(x[vs]) for x in self.own.values())
        if moved or named or unequal or mj.qpos0[qs].any():
            return None
        axes = np.array([mj.jnt_axis[j] for j in joints])
        if types == [HINGE, HINGE]:
            return "universal" if np.linalg.norm(np.cross(*axes)) > 1e-6 else None
        if sorted(types) == [SLIDE, HINGE]:
            return "cylindrical" if np.abs(axes[0] - axes[1]).max() < CLOSE else None
        if len(joints) != 3 or np.abs(axes - np.eye(3)).max() > CLOSE:
            return None
        if types == [SLIDE, SLIDE, SLIDE]:
            return "translation"
        return "planar" if types == [SLIDE, SLIDE, HINGE] else None

    def add_joint_of_kind(self, kind: Kind, joints: list[int], parent: str, body: int, pose: Array) -> None:
        mj, names = self.mj, [self.joints[j] for j in joints]
        if kind == "cylindrical":  # angle, then travel
            joints = sorted(joints, key=lambda j: -int(mj.jnt_type[j]))
        row = KINDS[kind]
        axes = [name for name, is_needed in (("axis", row.has_axis), ("axis2", row.has_axis2)) if is_needed]
        given_axes = {name: mj.jnt_axis[j] for name, j in zip(axes, joints)}
        if kind == "planar":  # its axis is the normal, that of the third joint
            given_axes = {"axis": np.array([0.0, 0.0, 1.0])}
        name = self.new("joint", _common_name(names))
        self.builder.add_joint(name, kind, parent, self.bodies[body], pose, **given_axes, **self.losses(joints[0]))
        self.note(name, kind, joints)

    def add_chain(self, joints: list[int], parent: str, body: int, pose: Array) -> None:
        """One joint after the other, with massless links between them.

        `pose` is that of the body, as far as it is carried, in `parent`.  Joints act in the body's frame: T(pos) J(q) T(−pos).
        """
        mj = self.mj
        for j in joints:
            kind, name = int(mj.jnt_type[j]), self.joints[j]
            at = mj.jnt_pos[j] if kind in (HINGE, BALL) else np.zeros(3)
            is_body = j == joints[-1] and np.abs(at).max() <= CLOSE
            child = self.bodies[body] if is_body else self.new("link", f"{name}_frame")
            if not is_body:
                self.builder.add_link(child)
            placement = pose @ moved(at) @ self.motion_of(j, kind, -self.reference(j, kind))
            if j in self.held:
                self.builder.add_joint(name, "fixed", parent, child, placement @ self.motion_of(j, kind, self.held[j]))
                self.layout.setdefault("held", []).append([int(mj.jnt_qposadr[j]), int(mj.jnt_dofadr[j]), self.held[j]])
                self.not_carried(f"held at {self.held[j]:.6g} by an equality constraint, and fixed there; range, spring, losses and motors", name)
                parent, pose = child, moved(-at)
                continue
            self.builder.add_joint(name, cast("Kind", OF_MUJOCO[kind].name), parent, child, placement, **self.numbers_of(j, kind))
            self.note(name, ("free", "ball", "plain", "plain")[kind], [j], placement)
            parent, pose = child, moved(-at)
        if parent != self.bodies[body]:
            self.weld(self.bodies[body], parent, pose)

    def reference(self, j: int, kind: int) -> float:
        """MuJoCo's position where the body is as the file has it."""
        return float(self.mj.qpos0[self.mj.jnt_qposadr[j]]) if kind in (SLIDE, HINGE) else 0.0

    def motion_of(self, j: int, kind: int, q: float) -> Array:
        if q == 0.0:
            return np.eye(4)
        if kind == SLIDE:
            return moved(q * self.mj.jnt_axis[j])
        return frame(np.array([np.cos(q / 2), *(np.sin(q / 2) * self.mj.jnt_axis[j])]), np.zeros(3))

    def effort_limits(self) -> dict[int, float]:
        """The largest effort of each joint that has motors or a range of forces, those of its followers included."""
        number = {name: j for j, name in enumerate(self.joints)}
        family = {}
        for j in self.followers:
            leader, multiplier = j, 1.0
            while leader in self.followers:
                multiplier *= self.followers[leader][1]
                leader = number[self.followers[leader][0]]
            family[j] = (leader, multiplier)
        found = {}
        for j, own in led({j: own for j, own in effort_ranges(self.mj).items() if j not in self.held}, family).items():
            if (limit := limit_of(own)) is not None:
                found[j] = limit
                if -own[0] != own[1]:
                    self.not_carried(f"unequal efforts, {own[0]:.6g} to {own[1]:.6g}; the limit is {limit:.6g} both ways, and the rest", self.joints[j])
        return found

    def say_handles(self) -> None:
        """Mocap bodies, and what welds the robot to them, which would make a rigid structure of it."""
        if not self.handles:
            return
        names = [name_of(self.mj, i) for i in range(self.mj.neq) if is_of_handle(self.mj, i, self.handles)]
        ties = f", with equality constraint {', '.join(names)}" if names else ""
        some = [self.bodies[i] for i in sorted(self.handles)]
        self.said.append(f"mocap body {', '.join(some)}: a handle by which a simulator moves the robot, and no part of it; left out{ties}")

    def numbers_of(self, j: int, kind: int) -> dict[str, Any]:
        mj, numbers = self.mj, self.losses(j)
        if kind in (SLIDE, HINGE):
            numbers["axis"] = mj.jnt_axis[j]
            numbers["mimic"] = self.followers.get(j)
            numbers["spring_stiffness"] = float(mj.jnt_stiffness[j])
            numbers["spring_rest"] = float(mj.qpos_spring[mj.jnt_qposadr[j]])
            if mj.jnt_limited[j]:
                numbers["limits"] = tuple(map(float, mj.jnt_range[j]))
            if j in self.efforts:
                numbers["effort"] = self.efforts[j]
        else:
            if mj.jnt_limited[j]:
                self.not_carried("range of a ball", self.joints[j])
            if mj.jnt_stiffness[j]:
                self.not_carried("stiffness", self.joints[j])
        return numbers

    def losses(self, j: int) -> dict[str, Any]:
        """Damping, friction and armature, the same for all coordinates of the joint."""
        mj, name, numbers = self.mj, self.joints[j], {}
        v = slice(int(mj.jnt_dofadr[j]), int(mj.jnt_dofadr[j]) + OF_MUJOCO[int(mj.jnt_type[j])].nv)
        for ours, theirs in (("damping", "damping"), ("friction", "frictionloss"), ("armature", "armature")):
            values = self.own[theirs][v]
            if ours == "armature" and values.any() and int(mj.jnt_type[j]) == FREE:  # mostly that of a default class
                self.not_carried("armature of a free joint", name)
            elif values.any() and np.ptp(values):
                self.not_carried(f"{theirs}, unequal", name)
            elif values.any():
                numbers[ours] = float(values[0])
        return numbers

    def note(self, name: str, kind: str, joints: list[int], placement: Array | None = None) -> None:
        """Where MuJoCo has the numbers of a joint."""
        q, v = self.mj.jnt_qposadr, self.mj.jnt_dofadr
        rows = [(j, OF_MUJOCO[int(self.mj.jnt_type[j])]) for j in joints]
        entry: dict[str, Any] = {
            "kind": kind,
            "q": [int(q[j]) + i for j, row in rows for i in range(row.nq)],
            "v": [int(v[j]) + i for j, row in rows for i in range(row.nv)],
        }
        if kind == "free" and placement is not None:
            entry["placement"] = placement.tolist()
        self.layout["joints"][name] = entry

    def add_sites(self) -> None:
        """Named sites are MuJoCo's frames."""
        mj = self.mj
        for i in range(mj.nsite):
            if (name := mj.site(i).name) and int(mj.site_bodyid[i]) not in self.handles:
                link = self.new("link", name if name not in self.names["link"] else f"{name}_site")
                self.builder.add_link(link)
                self.weld(link, self.bodies[mj.site_bodyid[i]], frame(mj.site_quat[i], mj.site_pos[i]))

    def add_loops(self) -> None:
        for closure in self.closures:
            predecessor, successor = (self.bodies[b] for b in closure.bodies)
            name = self.new("joint", common_name(closure.names) or f"{predecessor}_{successor}_loop")
            self.builder.add_loop(name, cast("Kind", closure.kind), predecessor, successor, closure.predecessor_pose, closure.successor_pose, axis=closure.axis)
        places = {q: name for name, entry in self.layout["joints"].items() for q in entry["q"]}
        names = {j: places[int(self.mj.jnt_qposadr[j])] for j in self.driven}
        leader = {self.joints[j]: coupling[0] for j, coupling in self.followers.items()}
        floats = {self.joints[j] for j in range(self.mj.njnt) if self.mj.jnt_type[j] == FREE}
        found, self.other_actuators = drives(self.mj, names, leader, floats)
        if found:
            core_of_builder(self.builder).set_drives(found, [])

    def not_carried(self, what: str, joint: str) -> None:
        self.unused.setdefault(what, []).append(joint)

    def unused_lines(self) -> list[str]:
        mj = self.mj
        lines = [f"joint {', '.join(names)}: {what} (not used)" for what, names in self.unused.items()]
        for what in ("dof_dampingpoly", "jnt_stiffnesspoly", "actuator_dampingpoly"):
            if np.any(getattr(mj, what, 0)):
                lines.append(f"{'actuator ' * what.startswith('actuator')}{what.partition('_')[2]} (nonlinear terms are not used)")
        if yields := [self.joints[j] for j in np.flatnonzero(getattr(mj, "jnt_springyield", ()))]:
            lines.append(f"joint {', '.join(yields)}: springyield (not used)")
        if off := sum(is_off(mj, i) for i in range(actuator_count(mj))):
            lines.append(f"actuator ({off} of {actuator_count(mj)} turned off by the file: no effort of theirs counts)")
        if mj.body_gravcomp.any():
            lines.append(f"gravcomp ({np.count_nonzero(mj.body_gravcomp)} bodies; gravity acts on them in full)")
        if bases := sum(1 for i in range(mj.nbody) if mj.body_mocapid[i] >= 0 and i not in self.handles):
            lines.append(f"mocap bodies ({bases}; welded where the file has them)")
        if mj.opt.density or mj.opt.viscosity:
            lines.append("density, viscosity (no forces of a fluid)")
        lines += self.equality_lines() + self.of_tendons
        for word, count in (
            ("geom", mj.ngeom), ("actuator", self.other_actuators if self.closures else actuator_count(mj)), ("tendon", mj.ntendon - self.force_elements), ("sensor", mj.nsensor), ("contact pair", mj.npair), ("contact exclude", mj.nexclude),
            ("flex", getattr(mj, "nflex", 0)), ("skin", mj.nskin), ("camera", mj.ncam), ("light", mj.nlight), ("keyframe", mj.nkey), ("plugin", mj.nplugin),
        ):  # fmt: skip
            if count:
                lines.append(f"{word} ({count})")
        return lines

    def equality_lines(self) -> list[str]:
        """Constraints that are not closed, and what isn't used of the others."""
        mj, lines = self.mj, []
        left: dict[str, int] = {}
        for i in range(mj.neq):
            if i not in self.carried:
                kind = int(mj.eq_type[i])
                word = KINDS_OF_EQUALITY[kind] if kind < len(KINDS_OF_EQUALITY) else str(kind)
                word += " to a mocap body" if is_of_handle(mj, i, self.handles) else "" if is_active(mj, i) else ", not active"
                left[word] = left.get(word, 0) + 1
        lines += [f"equality {word} ({count})" for word, count in sorted(left.items())]
        if self.closures:
            loops = "1 loop" if len(self.closures) == 1 else f"{len(self.closures)} loops"
            lines.append(f"solref, solimp of equality constraints ({loops}, closed exactly)")
        return lines


def _one_line(text: object) -> str:
    return " ".join(str(text).split())


def _common_name(names: list[str]) -> str:
    """hip of hip_x and hip_y; a+b of names that have no word in common."""
    common = os.path.commonprefix(names)  # noqa: RUF071 - letters in common are meant, not folders
    word = common.rstrip("_-./ ")
    ends_there = common != word or all(re.fullmatch("[xyzXYZ0-9]?", name[len(common) :]) for name in names)
    return word if word and ends_there else "+".join(names)


def _symmetric(x: Array) -> Array:
    return (x + x.T) / 2
