"""The limits of the robot's file, beside what a motion needs."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ksl.load_cases.quantities import JointLoads, unit
from ksl.mechanism import Joint, Mechanism
from ksl.motions.columns import METRES, columns_of
from ksl.motions.motion import Motion

if TYPE_CHECKING:
    pass


def exceeded_limits(model: Mechanism, motion: Motion, loads: list[JointLoads]) -> list[str]:
    """A line for each limit of the file that the motion exceeds."""
    lines = []
    for l in loads:
        j = l.joint
        if len(j.limits) > 1:
            for c, (column, (lower, upper)) in enumerate(zip(columns_of(j)[0], j.limits, strict=True)):
                x, of = motion.q[:, j.q_index + c], column.rpartition(".")[2]
                m_or_rad = "m" if of in METRES else "rad"
                lines += _exceeded(j, of, "lower", float(x.min()), lower, m_or_rad, lambda x, limit: x < limit)
                lines += _exceeded(j, of, "upper", float(x.max()), upper, m_or_rad, lambda x, limit: x > limit)
        if not j.one_coordinate or l.speed is None:
            continue
        q = model._position_of(j, motion.q)
        if j.has_limits:
            lines += _exceeded(j, "position", "lower", float(q.min()), j.lower, j.unit, lambda x, limit: x < limit)
            lines += _exceeded(j, "position", "upper", float(q.max()), j.upper, j.unit, lambda x, limit: x > limit)
        lines += _exceeded(j, "speed", "velocity", float(np.abs(l.speed).max()), j.velocity, unit("speed", j), lambda x, limit: x > limit)
        if l.effort is not None:
            lines += _exceeded(j, "effort", "effort", float(np.abs(l.effort).max()), j.effort, unit("effort", j), lambda x, limit: x > limit)
    return lines


def _exceeded(joint: Joint, what: str, which: str, value: float, limit: float | None, unit: str, beyond: Callable[[float, float], bool]) -> list[str]:
    if limit is None or not beyond(value, limit):
        return []
    return [f"{joint.name}: {what} {value:.4g} {unit} is beyond the {which} limit {limit:.4g} {unit}"]
