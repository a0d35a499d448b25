"""Samples that were dropped or held, in positions that nobody differentiates since velocities are given: without a look at them nothing shows it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ksl.mechanism.joint_kinds import KINDS
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.joint_kinds import columns_of, units_of
from ksl.motions.signal.corners import Found
from ksl.motions.signal.quality import Samples
from ksl.motions.signal.rates import SPLINE_SAMPLES, jumps_of

SAME = 2.5
"""Jumps of a position and of its velocity that are closer than this many steps are one fault, which is named once."""


def doubts_about_positions(joints: tuple[Joint, ...], samples: Samples, of_velocities: Mapping[str, Found]) -> list[str]:
    """A sentence for each column of positions, beside given velocities, with a sample that is off, or with a jump.  O(n nv).

    of_velocities: by column, what has been found in the velocities.
    """
    columns: dict[str, tuple[int, str, float]] = {}
    for joint, (v, _) in zip(joints, samples.given, strict=True):
        if v is not None and KINDS[joint.kind].velocity_is_rate:
            position, velocity, _ = columns_of(joint)
            turns = [2 * np.pi if unit == "rad" else np.inf for unit in units_of(joint)[0]]
            columns |= {p: (joint.q_index + k, rate, turn) for k, (p, rate, turn) in enumerate(zip(position, velocity, turns, strict=True))}
    if not columns or len(samples.time) < SPLINE_SAMPLES:
        return []
    found = jumps_of(samples.time, samples.q[:, [c for c, *_ in columns.values()]], 2)
    near = SAME * float(np.median(np.diff(samples.time)))
    said = []
    for (column, (_, rate, turn)), one in zip(columns.items(), found, strict=True):
        named = [t for _, t, _ in of_velocities[rate].impossible] if rate in of_velocities else []
        jumps = [
            (order, t, size) for order, t, size in one.impossible if order <= 0 and not abs(abs(size) - turn) <= 0.01 * turn
        ]  # a turn is no other position
        faults = [(order, t, size) for order, t, size in jumps if all(abs(t - other) > near for other in named)]
        if faults:
            said.append(_sentence(column, rate, faults))
    return said


def _sentence(column: str, rate: str, faults: list[tuple[int, float, float]]) -> str:
    order, time, size = min(faults, key=lambda fault: abs(fault[0]))
    often = f" ({len(faults)} such places)" if len(faults) > 1 else ""
    what = f"the sample of {column} at {time:.6g} s is {size:.4g} off those around it" if order else f"{column} jumps by {size:.4g} at {time:.6g} s"
    return f"{what}{often}, while {rate} goes on as before: efforts there are those of another position. Remove or mend these samples"
