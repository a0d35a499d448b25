"""What motors do to joints through rods, and back: positions, velocities, efforts, inertia and limits."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

from numpy.typing import ArrayLike

from ksl.drivetrain.c_maps import maps_in_c
from ksl.drivetrain.efforts import EffortMap
from ksl.drivetrain.motion import COMPILED, Carrier
from ksl.drivetrain.ranges import Range, range_of
from ksl.drivetrain.region import usable_positions
from ksl.drivetrain.serial import SerialErrors, serial_errors, serial_model
from ksl.drivetrain.sharing import Sharing, require_as_many
from ksl.mechanism.states import Array

if TYPE_CHECKING:
    from ksl.model.model import Model


def actuation(
    m: Model, joints: Iterable[str], start: ArrayLike | None = None, ball_limits: Mapping[str, float] | None = None, sharing: Sharing | None = None
) -> Actuation:
    """The map between what motors do and what these joints do, through the loops that connect them.

    joints: names, in the order of the columns of q, v, a and tau below; a joint with several coordinates has as many columns.
    start (nq): a closed position on the assembly that is meant; by default the closed one nearest to the neutral position.
    ball_limits: {joint: angle}, rad: how far a rod swings at most in a ball at its end from its line at the start; files have no such limits.
    They count where limits do.  Turning about its own line is no swing.
    sharing: how motors that are more than the joints share efforts: "limits", those with the least sum of (effort / effort limit)²; "weights", of weight × effort²,
    with the weights of the model's drives (m.with_drives({motor: weight})).  By default such motors are refused.  Polytopes and boxes allow any sharing.
    Numbers of motors are those of their joints, on the output side of gears; limits are the file's.  SI units, rad.

    Raises ValueError for joints that no motor moves, for what is no joint, and where joints and motors are not as many as the freedoms of the
    mechanism that they are in; the sentence names what is missing.  A joint in no loop that has a motor is its own motor.

        a = m.actuation(["ankle_pitch", "ankle_roll"])
        tau_motors = a.motor_efforts(q, v, a)
    """
    return Actuation(m, joints, start, ball_limits, sharing)


class Actuation(EffortMap):
    """The map, made by :func:`ksl.actuation`.  q, v, a, tau: (…, joints), in the order of `joints`; motors' numbers (…, motors), as `motors`.

    All is on the assembly that is reached from `start` without passing a dead centre.  A call costs some tens of microseconds a state in a
    batch, and some milliseconds alone; positions are followed from the start, about ten steps a radian.
    """

    def range(self, joint: str, at: ArrayLike | None = None, limits: bool = True) -> Range:
        """How far one joint moves from `at` (joints), with the others kept there: to a limit, to the end of reach, or where motors hold nothing.

        joint: one of `joints`.  at: by default the start.  limits: whether limits of the joint, of motors and of rods' joints count.

            a.range("knee").upper, a.range("knee").upper_by                     # 1.16, "hold"
        """
        return range_of(self, joint, at, limits)

    # the serial model

    def serial_model(self, at: ArrayLike | None = None, limits: Literal["safe", "mean"] = "safe") -> Model:
        """An open tree with these joints, for a simulator that has no loops: rods and cranks are cut off, and an armature stands for them and the rotors.

        at (joints): where total mass, centre of mass and the diagonal of the mass matrix are exactly those of the closed mechanism with its
        rotors; by default the start.  Over the range what a tree can't carry is least in root mean square; in single states it can be worse
        than rods cut off, since an armature has no off-diagonal: :meth:`serial_errors` says by how much.
        limits: of efforts and velocities, the largest boxes by volume of all positions of the range together, "safe", or their "mean".
        Positions near the ends of reach and hold, 5 % of the range, are left out.

        Its physics are those of this model and "armature".  `to_urdf` writes it; :func:`ksl.mjcf.write` writes it as MJCF.
        """
        return serial_model(self, self.with_rotors, at, limits)

    def compile(self, calls: str | Sequence[str] = COMPILED, samples: int = 1000, compiler: str | None = None) -> Actuation:
        """Returns this map with code that is compiled for it alone: positions, Jacobians, velocities and static efforts are computed by it.

        calls: some of motors_of, joints_of, jacobian, motor_jacobian, motor_velocities, joint_velocities, static_motor_efforts and static_joint_efforts;
        by default all.  samples: positions of the range that are tried for the fit.  compiler: as of :meth:`ksl.Model.compile`, as is the cache.

        A fitted start and a fixed number of Newton's steps are computed in lanes.  Where they leave more than 1e-12 rad or m, and out of the range that was tried,
        states are computed as before: arguments, sentences and results are those of this map, which differ by rounding.
        A call with start= is computed as before.  Raises ksl.CompilerError, and ValueError for a call that is none of these.

            fast = a.compile(["joints_of"])
            q = fast.joints_of(theta)                                               # (1000000, 2)
        """
        from ksl.drivetrain.compiled_maps import compiled_calls

        require_as_many(self.motors, self.part)
        found = copy(self)
        found.code = {**self.code, **compiled_calls(self, self.usable(samples), calls, compiler)}
        return found

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "code": {}}  # a pickle has no code

    def c_code(self, name: str = "leg", samples: int = 240) -> dict[str, str]:
        """{file: text} of the maps in both directions as C99 for a controller, which need no library.

        NAME_maps.h has `NAME_motors_of(joints, motors, jacobian)` and `NAME_joints_of`: a fitted start and a fixed number of Newton's steps over the equations of the
        loops, of any kind; the header states the largest error over the range.
        name: before files and functions.  samples: positions of the range that are tried for the fit.  Raises ValueError for a name that is none in C.

            for file, text in a.c_code("ankle").items():
                Path(file).write_text(text)
        """
        require_as_many(self.motors, self.part)
        return maps_in_c(self, self.usable(samples), name)

    def serial_errors(self, serial: Model, q: ArrayLike, v: ArrayLike, a: ArrayLike, carrier: Carrier | None = None) -> SerialErrors:
        """How far efforts of a serial model are off along states q, v, a (…, joints), beside the tree whose rods and cranks are cut off."""
        return serial_errors(self, self.with_rotors, serial, (q, v, a), carrier)

    def usable(self, count: int = 240, seed: int = 0) -> Array:
        """At most `count` random positions (n, joints) within all limits, in reach, and where motors hold, a little away from both ends."""
        return usable_positions(self, self.start[self.of_joints], count, seed)

    @cached_property
    def with_rotors(self) -> Actuation:
        """This map of a model whose physics name rotors and armatures, too."""
        physics = list(dict.fromkeys([*self.model.physics, "armature", *([] if "rotor bodies" in self.model.physics else ["rotor"])]))
        return (
            self
            if set(physics) == set(self.model.physics)
            else Actuation(self.model.with_physics(physics, self.model.friction_width), self.joints, self.start, self.ball_limits, self.sharing)
        )
