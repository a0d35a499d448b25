"""Small motions about a pose: the calls, which the room small_motions computes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, cast

from numpy.typing import ArrayLike

from ksl.base.higher_rooms import function_of
from ksl.mechanism.mechanism import Mechanism
from ksl.mechanism.states import Array, External, ExternalAxes
from ksl.mechanism.stiffness import Stiffnesses
from ksl.model.linear_model import LinearModel
from ksl.model.poses_at_rest import Equilibrium, Modes


class SmallMotions(Mechanism):
    """Frequencies, compliances, equilibria and linear models."""

    def modes(self, q: ArrayLike, stiffness: Stiffnesses | None = None, gravity: bool = True) -> Modes:
        """Natural frequencies and shapes of small motions about a pose, undamped, at standstill.

        q (nq): the pose under load, in which drives and preloaded springs hold the mechanism; loops are closed there.
        stiffness: {joint: …} or a file as :meth:`with_stiffness` takes it, N/m and N m/rad, of any joint, fixed ones, `base` and those of loops too; 0 where nothing resists; by
        default those of the model.  Gears in classes have the slope at the torque of the weight.  A joint that isn't named is rigid.  Along its motion a joint without a stiffness is locked where it has a motor
        (all joints of a tree, the drives of other mechanisms), and free where it has none, as a floating base is.  Springs of joints and force elements
        count where physics names them, and so do armature and rotors.
        gravity: with the second derivative of the potential of weight, along the closed mechanism; a pose that falls if it is let go has negative ones.

        Returns `frequencies` (n) in Hz, rising, −f where the square is negative, 0 where nothing resists, and then `zero` names the joints that
        move; `shapes` (n, links, 6), twists of links at their origins in their axes, of unit modal mass; `participation` and `effective_mass`
        (n, 6) for motions of the ground along and about the world's axes; `strain` (n, joints), shares of `joints` in the energy.
        Small displacements are those of joints: of the child's origin, and the rotation vector, in the axes of the joint's frame.

        Raises ValueError for stiffnesses that don't fit, open loops, and massless parts that nothing holds.
        Dense algebra: O(n³), n being the displacements of all joints; some milliseconds for a robot with six compliances in each joint.

            gears = {"shoulder_pan": 2.5e4, "elbow": {"motion": 1.2e4, "axial": 4e7, "radial": 6e7, "tilting": 9e4}}
            m.modes(q, stiffness=gears).frequencies                             # Hz
        """
        return cast("Modes", function_of("modes")(self, q, stiffness, gravity))

    def compliance(self, q: ArrayLike, frame: str, stiffness: Stiffnesses | None = None, axes: Literal["frame", "world"] = "frame") -> Array:
        """The compliance (6, 6) of a frame about its origin: from a wrench on it to its small displacement, linear first; m/N … rad/(N m).

        q (nq): the pose.  frame: a link, or a joint, which stands for its link.  stiffness: as in :meth:`modes`; weight adds none here.
        axes: of the frame or the world.

        Raises ValueError where nothing resists a wrench, and names the joints that would move.  Dense algebra: O(n³).

            C = m.compliance(q, "tool0", stiffness={"elbow": 1.2e4})            # (6, 6)
            pushed = C @ [0, 0, 50.0, 0, 0, 0]                                  # (6,): what 50 N along z move it by
        """
        return cast("Array", function_of("compliance")(self, q, frame, stiffness, axes))

    def deflection(
        self,
        q: ArrayLike,
        v: ArrayLike,
        a: ArrayLike,
        frame: str,
        stiffness: Stiffnesses | None = None,
        external: External | None = None,
        axes: Literal["frame", "world"] = "frame",
        by: Literal["frame", "joint"] = "frame",
        external_axes: ExternalAxes = "link",
    ) -> Array:
        """The small displacement (…, 6) of a frame under the wrenches of a motion, statically; linear first, m and rad.

        q (…, nq), v and a (…, nv), external, external_axes: as in :meth:`inverse_dynamics`.  frame, stiffness, axes: as in :meth:`compliance`.
        by: "frame", the whole; "joint", the shares (…, joints, 2, 6) of all `joints`: [0] along their motions, of gears and drives, [1] else, of bearings.
        Gears in classes twist by the torque of each state.  Each joint gives way by minus its compliance times the wrench that it transmits; the wrenches are those of the rigid mechanism.

        Raises ValueError where nothing resists a wrench.  Dense algebra for each state: O(n³).

            off = m.deflection(q, v, a, "tool0", stiffness={"elbow": 1.2e4})
        """
        return cast("Array", function_of("deflection")(self, q, v, a, frame, stiffness, external, axes, by, external_axes))

    def equilibrium(self, q: ArrayLike, tau: ArrayLike | None = None, external: External | None = None, external_axes: ExternalAxes = "link") -> Equilibrium:
        """The pose nearest to q at rest: efforts balance weight, external wrenches, and springs and force elements where physics names them.

        q (nq): where the search begins.  tau (nv): efforts, N m or N, zero by default; of a mechanism with loops those of its drives.
        external, external_axes: as in :meth:`inverse_dynamics`.  Loops are kept closed.
        Returns `q`, `converged`, `reason`, `residual`, `stiffness` (n, n) of the coordinates `independent`, and whether the pose is `stable`.

        Newton's method with analytic derivatives, steps of at most 0.5 rad or m, so that unstable poses are found, too.  What is nearest is local.  Where the search ends
        elsewhere, `converged` is false; nothing is raised.  O(nv³) for each step.

            rest = m.with_physics("spring").equilibrium(m.neutral())
        """
        return cast("Equilibrium", function_of("equilibrium")(self, q, tau, external, external_axes))

    def linearise(
        self, q: ArrayLike, v: ArrayLike | None = None, tau: ArrayLike | None = None, inputs: Iterable[str] | None = None, outputs: Iterable[str] = ()
    ) -> LinearModel:
        """The linear model ẋ = rate + A x + B u, y = y₀ + C x + D u about a state, of a tree or a closed mechanism.

        q (nq), v and tau (nv): the state and its efforts, zero by default; it may move, and `rate` is then not zero and `equilibrium` false.
        x = (q ⊖ q₀, v − v₀) of `coordinates`, the independent ones in the order of :meth:`independent`; u = tau − tau₀ of `inputs`; rad, m, N m, N, s.
        inputs: joints, by default all but floating ones of a tree, and the drives of a mechanism.
        outputs: JOINT, JOINT.v and JOINT.a, as columns of motions, and JOINT.fx … .tz, the reaction at the joint in its axes.

        The result has `A`, `B`, `C`, `D`, into which it unpacks, `discrete(dt)`, `state_space()` for scipy.signal, and `control()` for the package control.
        The physics of the model counts: damping, springs, friction by its smooth law.  Analytic derivatives: O(nv³).
        Raises ValueError for rates that open loops, and for unknown names.

            l = m.linearise(q, outputs=["elbow", "elbow.tz"])
            step = l.discrete(0.002)
        """
        return cast("LinearModel", function_of("linearise")(self, q, v, tau, inputs, outputs))
