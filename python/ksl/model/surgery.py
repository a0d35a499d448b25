"""Models made from other models.  A model never changes: every call returns a new one."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ksl import _core
from ksl.base.errors import DescriptionWarning, QuaternionWarning
from ksl.base.files_read import InputFile
from ksl.base.input_files import path_given
from ksl.base.notes import NoteKind, Note, of_kind
from ksl.mechanism import given
from ksl.mechanism.calls import Calls
from ksl.mechanism.closed_reactions import ReactionsAsked, reactions_derivatives
from ksl.mechanism.lengths import extent, far_inertia, far_point, strong_gravity
from ksl.mechanism.payload import Payload, payload_of
from ksl.mechanism.requests import one_of
from ksl.mechanism.states import Array, External, ExternalAxes, Order, Part, Point, Side, Undetermined
from ksl.mechanism.stiffness import Stiffnesses, flexibilities_of, ground_of, table_of
from ksl.model.on_card import NO_CODE, CodeOnCard

S = TypeVar("S", bound="Surgery")


class Surgery(Calls):
    """The algorithms of a model, and models that are made from it.

    Every method raises :class:`ksl.DescriptionError` or ValueError, naming the link or joint and how to mend it.  Gravity and a floating
    base are kept unless a method says otherwise.
    """

    _on_card: CodeOnCard = NO_CODE

    def _made(self: S, core: _core.Model, inputs: tuple[InputFile, ...] | None = None, payloads: tuple[Payload, ...] | None = None) -> S:
        """A model of the same class that was not read from a file, with the payloads of this one unless others are given."""
        raise NotImplementedError

    def with_root(self: S, link: str) -> S:
        """The same robot with another root link.

        The joints between the two roots are reversed: parent and child change places, and the axis its direction, so that every joint
        keeps its q, v, effort, limits and their meaning; only their order in q changes (`joint_names`).  Links keep their frames: a
        reversed joint with an axis carries a massless link `JOINT_frame`, at the joint, to which the link that was its parent is welded.
        Reactions through it are those of the new child on the other side of the same joint.
        Joints on the way must be fixed or move on one axis (revolute, continuous, prismatic, helical, cylindrical).
        A fixed root is at the world's origin, with the world's axes; where the base floats, the new root floats.
        A stiffness of the joint that fixes the root to the ground is left out with a warning: it is that of what the old root stands on.
        Rotors that are bodies stay on their links.  "rotor bodies" that are named afterwards are on the new parent, of which a warning tells.
        """
        made = self._made(self._core.with_root(self._plain(given.name(link, "link"), "link")))
        self._warn([*_left_out(made, self), *_moved_rotors(made, self)])
        return made

    def without_loops(self: S) -> S:
        """The same robot with its loops cut: a tree, whose joints all have a drive.

        Loops are cut where the file has the joints that close them, so that efforts and reactions are those of another machine.
        """
        return self._made(self._core.without_loops())

    def with_drives(self: S, joints: given.Drives) -> S:
        """The same robot with motors at these joints and at no others.  Inverse dynamics of mechanisms with loops need to know them.

        joints: names, or {name: weight}.  Where there are more drives than freedoms, efforts are those with the least sum of weight × effort²,
        in N m and N; without weights all are 1.  A weight of 1 / limit² shares efforts by what motors can do.

            m = m.with_drives(["crank"])
        """
        names, weights = given.drives(joints)
        return self._made(self._core.with_drives([self._plain(name, "joint") for name in names], weights))

    def with_stiffness(self: S, stiffness: Stiffnesses) -> S:
        """The same mechanism, some of whose joints give way.

        :meth:`modes`, :meth:`compliance` and :meth:`deflection` use them all.  Reactions depend on those of joints that loops go through: rigid
        bodies leave reactions of redundant joints open.  With the stiffnesses that decide their split, :meth:`reactions` are those of
        least energy, and :meth:`reactions_unique` says which are still open: joints that aren't named are rigid.

        stiffness: {joint: …}, of any joint, with six numbers, N/m along x, y, z and N m/rad about them, of the joint's frame on
        the child's side, inf where it is rigid; or the (6, 6) matrix of a part that couples them, as a beam does; or, of a joint with an axis,
        a mapping with "axial" and "radial", N/m, and "tilting", N m/rad, of a bearing, "position" of its middle along the axis, m from the joint's origin,
        "torsional" of what doesn't turn about the axis, and "motion", N m/rad or N/m, of the gear or drive of a
        joint with one coordinate; or that number alone; or a gear's in classes, {"stiffness": [K1, K2, K3], "effort": [T1, T2]}, of which the model keeps the
        first, and a call with `stiffness=` takes that of the load.  A joint without an axis takes "axis" (3) beside them, and "at" (3) in place of "position".
        Along the joint's motion they have no effect on reactions.  Where some are 1e12 times as stiff as others, what they alone would decide stays open.  0 where nothing resists: no wrench is transmitted there, as far as others can balance.
        Or a TOML file with a table for each joint, or one of components, of which gears, bearings and bolted flanges say how they give way.

            m = m.with_stiffness({"A": {"axial": 2e7, "radial": 1e8, "tilting": 1e5}, "C": {"axial": 2e7, "radial": 1e8, "tilting": 1e5}})
        """
        given_ones, ground = flexibilities_of(self, table_of(self, stiffness)), ground_of(self)
        return self._made(self._core.with_compliances([("" if joint == ground else joint, *x.numbers()) for joint, x in given_ones.items()]))

    def _reactions_along(
        self, states: tuple[ArrayLike, ArrayLike, ArrayLike], external: External | None, on: Side, at: Point, axes: str, order: Order, part: Part,
        joints: Iterable[str] | None, out: object, external_axes: ExternalAxes, undetermined: Undetermined, threads: int | None,
    ) -> tuple[Array, Array, Array]:  # fmt: skip
        if out is not None:
            raise ValueError("reactions_derivatives: out= is for models without loops; the number of columns follows from the position")
        given.threads(threads)
        names = self.joint_names if joints is None else self._names_of(joints, "joints")
        for name in names:
            self._reaction_index(name)  # known
        self.reaction_request(on, at, axes, order, part, [])
        wanted = ReactionsAsked(list(names), on, at, axes, order, part)
        return reactions_derivatives(self, self.without_loops(), states, external, external_axes, wanted, undetermined)

    def _with_stiffness(self: S, stiffness: Stiffnesses) -> S:
        return self.with_stiffness(stiffness)

    def with_frozen_joints(self: S, joints: Mapping[str, ArrayLike]) -> S:
        """These joints become fixed at these positions.

        joints: {name: q}, a number, or as many as the joint has in q.  Names and links are kept, reactions through the joints are still
        available.  A `floating_base` that is frozen puts the root where it is, on a massless link `world`.  Mimic joints are frozen with
        their leaders, where these hold them; one alone is refused.

            held = m.with_frozen_joints({"elbow": 1.5})
        """
        positions = given.mapping(joints, "joints", "{joint: position}")
        frozen = [
            (self._plain(given.name(name, "a joint"), "joint"), [float(x) for x in given.numbers(q, f"joint {name}: its position").ravel()])
            for name, q in positions
        ]
        made = self._made(self._core.with_frozen_joints(frozen))
        for line in of_kind(made.warnings, NoteKind.QUATERNION):
            if line not in self.warnings:
                warnings.warn(line, QuaternionWarning, stacklevel=2)
        return made

    def with_payload(self: S, link: str, mass: float, center_of_mass: ArrayLike = (0.0, 0.0, 0.0), inertia: ArrayLike | None = None) -> S:
        """A rigid body is welded to a link: its mass, kg, its centre of mass (3) in the link's frame, m, and its inertia (3, 3) about
        that in the link's axes, kg m²; None for a point mass.  Lengths that are likely in millimetres are warned of.

            loaded = m.with_payload("tool0", 2.0, (0, 0, 0.05))
        """
        made = with_body(self, link, mass, center_of_mass, inertia)
        kilograms, center, tensor = given.mass(link, mass, center_of_mass, inertia)
        reach = extent(self)
        self._warn(far_point(f"the payload on {link} is", center, reach) + far_inertia(f"the inertia of the payload on {link}", kilograms, tensor, reach))
        return made

    def merged(self: S, other: Surgery, parent_link: str, pose: given.PoseLike | None = None, prefix: str = "") -> S:
        """This robot with another one on it.

        The root of `other` is welded to `parent_link`, at `pose`, (4, 4) or :class:`ksl.Pose`, in that link's frame, by a joint `PREFIXmount`.  If `other` floats,
        it floats there: the joint is then `PREFIXfloating_base`.  The names of its links and joints get the prefix.  Both need the
        same gravity; the physics of joints is this robot's.  A stiffness of the joint that fixes the root of `other` to the ground is left out with a warning.
        """
        if not isinstance(other, Surgery):
            raise ValueError(f"other is {type(other).__name__}; expected a model")
        link = self._plain(given.name(parent_link, "parent_link"), "link")
        placed = given.pose(pose, "pose", parent_link)
        core = self._core.merged(other._core, link, placed, given.name(prefix, "prefix"))
        self._warn(far_point("pose of merged: it is", placed[3:12:4], max(extent(self), extent(other)), f"the origin of {parent_link}"))
        made = self._made(
            core,
            tuple(dict.fromkeys((*self.inputs, *other.inputs))),
            (*self.payloads, *(replace(payload, link=f"{prefix}{payload.link}") for payload in other.payloads)),
        )
        self._warn(_left_out(made, self))
        return made

    def subtree(self: S, link: str, loops: Literal["refuse", "drop"] = "refuse") -> S:
        """What a link carries, and itself as the root.  The root is fixed unless it is that of a robot that floats.
        A mimic joint that would be without its leader is refused.  A stiffness of the joint that fixes the old root to the ground is left out with a warning.

        loops: of a loop that loses a link, "refuse" is an error that names it; "drop" leaves out the joint that closes it.
        """
        drop = one_of(loops, "loops", "refuse", "drop") == "drop"
        made = self._made(self._core.subtree(self._plain(given.name(link, "link"), "link"), drop))
        self._warn(_left_out(made, self))
        return made

    def with_frame(self: S, name: str, link: str, pose: given.PoseLike | None = None) -> S:
        """A frame `name`, at `pose`, (4, 4) or :class:`ksl.Pose`, in a link's frame, that may be used wherever a link may.

        It is a massless link, welded by a joint `NAME_joint`; no result of the other links changes, not in a bit.

            T = m.with_frame("tip", "tool0", ksl.Pose.from_rpy((0, 0, 0.1))).frame_pose(q, "tip")
        """
        on, placed = self._plain(given.name(link, "link"), "link"), given.pose(pose, f"frame {name}: its pose", link)
        made = self._made(self._core.with_frame(given.name(name, "name"), on, placed))
        self._warn(far_point(f"frame {name} is", placed[3:12:4], extent(self), f"the origin of {on}"))
        return made

    def with_parameters(self: S, parameters: Mapping[str, ArrayLike | tuple[float, ArrayLike, ArrayLike]]) -> S:
        """Other inertias for some links.

        parameters: {link: (mass, centre of mass (3), inertia (3, 3))}, as in :meth:`ksl.Builder.add_link`; or {link: (10)}, as regressors
        have them: m, m c, Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the link's origin, in its axes.  They replace all that the link had, payload
        included.  The structure is shared, not built again: O(links), some microseconds.  That the inertias are possible is not checked,
        except that masses are not negative.
        """
        others = given.mapping(parameters, "parameters", "{link: (mass, centre of mass, inertia) or ten numbers}")
        inertias = [(self._index(self._link_index, link, "link"), _ten_numbers(link, of)) for link, of in others]
        made = self._with_core(self._core.with_inertias(inertias))
        replaced = {self.link(link).name for link, _ in others}
        made.__dict__["payloads"] = tuple(payload for payload in self.payloads if payload.link not in replaced)
        return made

    def with_gravity(self: S, gravity: ArrayLike) -> S:
        """The same robot under another gravity (3), m/s² in world axes: on a wall or a ceiling, or on another planet.

        The structure is copied, not built again: some microseconds.  Numbers that are likely in mm/s² are warned of.
        """
        made = under_gravity(self, gravity)
        self._warn(strong_gravity(made.gravity))
        return made

    def _warn(self, doubts: Iterable[str]) -> None:
        """Warns, where a method was called, of numbers that are likely in another unit, and of what is left out."""
        for line in doubts:
            warnings.warn(line, DescriptionWarning, stacklevel=3)

    def _with_core(self: S, core: _core.Model, arguments: Any = None) -> S:
        """A model of the same structure, which shares all tables of names and requests.  arguments: of `load`, by which a pickle is made."""
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__, _core=core, _arguments=arguments)
        for name in ("links", "_on_card", *self._on_card.rows):
            other.__dict__.pop(name, None)
        return other

    def to_urdf(self, path: str | os.PathLike[str] | None = None) -> str:
        """The robot as URDF text, also written to a file if `path` is given.

        Numbers have the fewest digits that give the same double; what was read from a URDF file is written as it was read, so that
        loading it again gives a model with the same bits.  Kinds that URDF doesn't have are written under their names, which
        KSL reads.  Not written: geometry and whatever else KSL doesn't read (a comment lists it), gravity, and that the base floats.
        """
        text = self._core.urdf_text()
        if path is not None:
            from ksl.output import whole_file

            with whole_file(Path(path_given(path, "a file to be written"))) as part:
                part.write_text(text, encoding="utf-8", newline="")
        return text

    def _with_body(self: S, link: str, mass: float, center_of_mass: ArrayLike, inertia: ArrayLike | None) -> S:
        body = given.mass(f"payload on {link}", mass, center_of_mass, inertia)
        carrier = self._plain(given.name(link, "link"), "link")
        return self._made(self._core.with_payload(carrier, body), payloads=(*self.payloads, payload_of(carrier, body)))


def _left_out(made: Surgery, before: Surgery) -> list[Note]:
    """What a model says of a stiffness that it doesn't have any more, and the one that it is made from has."""
    return [line for line in of_kind(made.warnings, NoteKind.STIFFNESS) if line not in before.warnings]


def _moved_rotors(made: Surgery, before: Surgery) -> list[str]:
    """Where "rotor bodies" that are named of a model with another root are: on what is the parent of a joint then."""
    return [
        f'joint {j.name} is reversed: "rotor bodies" that are named of this model, or of the URDF that it writes, have its rotor on link '
        f"{made.joint(j.name).parent} in place of link {j.parent}; name them before with_root"
        for j in before.joints
        if j.rotor_inertia and j.one_coordinate and made.joint(j.name).parent != j.parent
    ]


def with_body(model: S, link: str, mass: float, center_of_mass: ArrayLike, inertia: ArrayLike | None = None) -> S:
    """As :meth:`Surgery.with_payload`, for rooms that say by themselves what is doubtful about its lengths."""
    return model._with_body(link, mass, center_of_mass, inertia)


def under_gravity(model: S, gravity: ArrayLike) -> S:
    """As :meth:`Surgery.with_gravity`, for the same rooms."""
    g = given.numbers(gravity, "gravity")
    if g.shape != (3,):
        raise ValueError(f"gravity has shape {g.shape}; expected three numbers, m/s² in world axes")
    other = model._with_core(model._core.with_gravity(g.tolist()))
    other.__dict__["gravity"] = g.astype(float)
    other.gravity.setflags(write=False)
    return other


def _ten_numbers(link: str, of: ArrayLike | tuple[float, ArrayLike, ArrayLike]) -> list[float]:
    """m, m c, Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the origin."""
    if isinstance(of, (tuple, list)) and len(of) == 3:
        mass, c, I = given.mass(f"link {link}", *of)
        x, y, z = c
        return [
            mass, mass * x, mass * y, mass * z,
            I[0] + mass * (y * y + z * z), I[1] - mass * x * y, I[4] + mass * (z * z + x * x),
            I[2] - mass * z * x, I[5] - mass * y * z, I[8] + mass * (x * x + y * y),
        ]  # fmt: skip
    array = given.numbers(of, f"link {link}: its parameters")
    if array.shape != (10,):
        raise ValueError(f"link {link}: its parameters have shape {array.shape}; expected (mass, centre of mass, inertia) or ten numbers")
    ten: list[float] = array.tolist()
    return ten


def with_compliances(model: S, compliances: Mapping[str, Sequence[float]]) -> S:
    """The model whose joints give way as :func:`ksl.mechanism.stiffness.compliances_of` says of another.  Raises ValueError."""
    known = {joint.name for joint in model.joints} | {loop.name for loop in model.loops}
    rows = []
    for joint, matrix in compliances.items():
        if joint not in known or np.shape(matrix) not in {(36,), (72,)} or not np.isfinite(np.asarray(matrix, dtype=float)).all():
            raise ValueError(f"compliance of joint {joint}: expected 36 finite numbers of a joint of {model.name}, or 72")
        numbers = [float(x) for x in matrix]
        rows.append((joint, numbers[:36], numbers[36:] or [0.0] * 36))
    return model._made(model._core.with_compliances(rows))
