"""The curves of the summary and the report, and the power balance."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ksl.load_cases.force_elements import act
from ksl.load_cases.load_case import Block, LoadCase
from ksl.load_cases.quantities import LEAST_ENERGY, LEAST_SHARE, JointLoads, PowerBalance, joint_loads, power_round_off, untold
from ksl.load_cases.reaction_joints import has_drive
from ksl.mechanism.states import EFFORT_PARTS, Array
from ksl.motions.closed_motion import closed_again
from ksl.motions.signal.rates import SPLINE_SAMPLES, rates_beside_corners
from ksl.motions.signal.standing import with_means


@dataclass
class Curves:
    """Collects from blocks the curves of the summary and the report.  The wrenches themselves are not kept."""

    case: LoadCase
    loads: list[JointLoads] = field(default_factory=list)

    def __post_init__(self) -> None:
        n = len(self.case.motion.time)
        self._drive, self._largest_effort = np.empty(n), 0.0
        self._dissipation = np.empty(n) if self.case.model.physics and not self.case.brake else None
        model = self.case.model
        for joint in self.case.joints:
            empty = joint_loads(joint, np.empty((0, 6)), None, None)
            position, speed, acceleration = self.case.joint_motions.of(joint) if joint.one_coordinate else (None, None, None)
            effort = np.zeros(n) if has_drive(model, joint) else None
            brake = np.empty(n) if effort is not None and self.case.braked.any() else None
            coupling = np.empty(n) if joint.leader is not None else None
            parts: dict[str, Array] = {name: np.empty(n) for name in EFFORT_PARTS} if model.physics and effort is not None and not self.case.brake else {}
            wrench: dict[str, Array] = {name: np.empty(n) for name in empty.wrench}
            self.loads.append(JointLoads(joint, wrench, speed, effort, coupling, parts, position, acceleration, brake))

    def add(self, block: Block) -> None:
        """Adds the samples `block.rows`; each sample must be added once, in any order."""
        followers = {name: i for i, name in enumerate(self.case.model.follower_names)}
        of_drives, of_brakes = block.of_drives(block.tau), block.of_brakes(block.tau)
        for i, collected in enumerate(self.loads):
            part = joint_loads(collected.joint, block.in_joint_axes[:, i], None, None, bool(block.without_axial_effort[i]))
            for name, x in part.wrench.items():
                collected.wrench[name][block.rows] = x
            for supplied, of in ((collected.effort, of_drives), (collected.brake, of_brakes)):
                if supplied is not None:
                    supplied[block.rows] = of[:, collected.joint.v_index]
            if collected.coupling is not None:
                collected.coupling[block.rows] = block.coupling[:, followers[collected.joint.name]]
            if block.parts is not None:
                for k, part_of_effort in enumerate(collected.parts.values()):
                    part_of_effort[block.rows] = block.of_drives(block.parts[:, k, collected.joint.v_index])
        self._drive[block.rows] = np.sum(block.tau * block.v, axis=1)
        if self._dissipation is not None and block.parts is not None:
            self._dissipation[block.rows] = np.sum((block.parts[:, 1] + block.parts[:, 2]) * block.v, axis=1)
            if act(self.case.model):
                damping = [element.damping for element in self.case.model.force_elements]
                self._dissipation[block.rows] += self.case.model.force_element_states(block.q, block.v).rate ** 2 @ damping
        self._largest_effort = max(self._largest_effort, float(np.max(np.abs(block.tau), initial=0.0)))

    def power_balance(self) -> PowerBalance | None:
        """The power balance, after all blocks; None if there are too few samples to differentiate the energy."""
        motion, external = self.case.motion, self.case.external
        if len(motion.time) < SPLINE_SAMPLES:
            return None
        if self.case.static:
            none = np.zeros(len(motion.time))
            return PowerBalance(none, none, none, none)
        q, v = motion.q, motion.resolved_v
        if motion.held is not None and motion.held.any():  # noise of their positions is no change of energy
            q = closed_again(self.case.model, motion, with_means(q, motion.held, self.case.model.joints))
        kinetic, potential = self.case.model.energy(q, v)
        energy = kinetic + potential
        supplied = self.case.model.external_power(q, v, external) if external else np.zeros(len(motion.time))
        round_off = power_round_off(motion.time, kinetic, potential, q, v, self._largest_effort)
        with np.errstate(divide="ignore", invalid="ignore"):  # what isn't finite is refused by the balance
            exchanged = float(np.max(np.abs(np.gradient(kinetic, motion.time)), initial=0.0))
        if motion.integrated:
            rate = self._rate_along(q, v, motion.resolved_a)
            least = max(LEAST_SHARE * float(np.max(kinetic)), LEAST_ENERGY * float(np.max(np.abs(potential))), round_off * float(np.max(np.diff(motion.time))))
            missed = untold(motion.time, energy, rate, np.concatenate([motion.corner_times, motion.break_times]), least)
            return PowerBalance(self._drive, supplied, energy, rate, round_off, self._dissipation, exchanged, True, missed)
        before, after = rates_beside_corners(motion.time, energy, motion.corner_times, motion.break_times)
        total = self._drive + supplied - (0.0 if self._dissipation is None else self._dissipation)
        # at a jump of the acceleration the power is that before or after it: the motion says which
        rate = np.where(np.abs(before - total) < np.abs(after - total), before, after)
        rate = np.where(np.isnan(before + after), total, rate)  # between events that follow so fast that nothing is to be told
        return PowerBalance(self._drive, supplied, energy, rate, round_off, self._dissipation, exchanged)

    def _rate_along(self, q: Array, v: Array, a: Array) -> Array:
        """The rate (n) of the energy at velocities and accelerations (n, nv), from its derivatives and not from the dynamics."""
        kinetic_by_q, kinetic_by_v, potential_by_q = self.case.model.energy_derivatives(q, v)
        rate: Array = np.sum((kinetic_by_q + potential_by_q) * v + kinetic_by_v * a, axis=-1)
        return rate
