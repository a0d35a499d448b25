"""The results of one load case: curves, rows of the summary, power balance, use of limits."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ksl.base.errors import MotionError
from ksl.base.notes import NoteKind, of_kind
from ksl.base.words import count
from ksl.load_cases.curves import Curves
from ksl.load_cases.load_case import Block, LoadCase
from ksl.load_cases.quantities import CAUSES_OF_RESIDUALS, UNDETERMINED, JointLoads, PowerBalance, SummaryRow, summarise
from ksl.load_cases.verdict import Use, uses_of
from ksl.mechanism.lengths import extent, far_inertia, far_point, strong_gravity
from ksl.mechanism.states import EFFORT_PARTS

HEAVY = 5.0
"""Payloads of so many times the robot's own mass are suspected to be in grams; arms carry up to about their own."""


@dataclass(frozen=True)
class CaseResult:
    """What is kept of a load case.  Its wrenches are not: they are written, or computed again."""

    case: LoadCase
    loads: list[JointLoads] | None
    """Curves of all joints, in the order of `LoadCase.joints`; None where they were dropped to save memory."""
    rows: list[SummaryRow]
    """A row for each joint, in the same order."""
    balance: PowerBalance | None
    uses: list[Use]
    doubts: list[str]
    """Why the numbers themselves are doubted, most important first."""


def compute_case(case: LoadCase, sink: Callable[[Block], None] | None = None, advance: Callable[[int], None] | None = None) -> CaseResult:
    """Computes a load case block by block, while a second thread gives the previous block to `sink`.

    advance: is told the number of samples of each block.  Raises MotionError where results are not finite.
    """
    curves = Curves(case)
    with np.errstate(over="ignore", invalid="ignore"), ThreadPoolExecutor(1) as pool:  # what is not finite is refused
        pending = None
        for block in case.blocks():
            _check_block(case, block)
            if pending:
                pending.result()
            pending = pool.submit(sink, block) if sink else None
            curves.add(block)
            if advance:
                advance(len(block.time))
        if pending:
            pending.result()
        balance = curves.power_balance()
        rows: list[SummaryRow] = [{"case": case.name, **summarise(case.motion.time, loads)} for loads in curves.loads]
        if case.model.loops:
            rows = [row | {UNDETERMINED: " ".join(case.undetermined.of(str(row["joint"])))} for row in rows]
    _check_summary(case, rows, balance)
    uses = [use for joint, row in zip(case.joints, rows, strict=True) for use in uses_of(joint, row, case.motion.time, case.motion.q)]
    return CaseResult(case, curves.loads, rows, balance, uses, doubts_of(case, balance))


def doubts_of(case: LoadCase, balance: PowerBalance | None = None) -> list[str]:
    """Why the numbers of a load case are doubted; those that its power balance tells where it is given."""
    lines = [*case.motion.doubts, *case.motion.contradictions]
    if balance is not None and balance.doubtful:
        lines.append(f"power balance: the residual is {balance.relative_residual:.2g} of the largest power: {CAUSES_OF_RESIDUALS}")
    if balance is not None and balance.untold is not None:
        lines.append(str(balance.untold))
    lines += _about_drives(case)
    return _about_payloads(case) + _about_lengths(case) + lines + of_kind(case.model.warnings, NoteKind.MASSES)


def _about_drives(case: LoadCase) -> list[str]:
    """More drives than freedoms share the efforts as their control does."""
    closing, model = case.motion.closing, case.model
    drives = sum(model.joint(name).nv for name in model.drives or ())
    if not model.loops or closing is None or drives <= closing.freedoms or case.brake:
        return []
    named = ", ".join(model.drives or ())
    if closing.freedoms == 0:
        return [f"{named}: the mechanism is rigid, and drives move nothing: efforts are those of least norm, and what is braced against what is another matter"]
    return [
        f"{named}: {drives} drives move {count(closing.freedoms, 'freedom')}: efforts are those of least norm, and how the control shares them is another matter"
    ]


def _about_payloads(case: LoadCase) -> list[str]:
    own = case.model.mass - sum(p.mass for p in case.payloads)
    return [line for p in case.payloads for line in heavy(f"the payload on {p.link} has", p.mass, own)]


def heavy(what: str, mass: float, own: float) -> list[str]:
    """A payload far beyond what the robot could carry is suspected to be in grams.  what: of which payload; own: the robot's mass, kg."""
    return [f"{what} {mass:g} kg, {mass / own:.3g} times the robot's own {own:.4g} kg: is that in grams? Masses are in kg"] if 0 < HEAVY * own < mass else []


def _about_lengths(case: LoadCase) -> list[str]:
    """Points and inertias that are likely in millimetres, and gravity."""
    p, found = case.placement, strong_gravity(case.model.gravity)
    points = {"the point of the moments is": p.at} if not isinstance(p.at, str) else {}
    points |= {f"the point of the moments of {joint} is": point for joint, point in p.points.items()}
    if not points and not case.payloads:
        return found
    reach = extent(case.model, [x.carried for x in case.payloads])
    for what, point in points.items():
        found += far_point(what, point, reach, "the joint's origin")
    for x in case.payloads:
        found += far_point(f"the payload on {x.link} is", x.center, reach)
        found += far_inertia(f"the inertia of the payload on {x.link}", x.mass, x.inertia or (), reach)
    return found


def _check_block(case: LoadCase, block: Block) -> None:
    """Refuses results that overflow, because numbers of the motion, of external wrenches or of the robot are finite but huge."""
    if _all_finite(block.total, block.constraint, block.in_joint_axes, block.tau, block.tau * block.v, *([] if block.parts is None else [block.parts])):
        return

    def where(sample: int) -> str:
        return f"sample {block.rows.start + sample + 1} (time {block.time[sample]:.9g})"

    for x in (block.total, block.constraint, block.in_joint_axes):
        if not np.isfinite(x).all():
            sample, joint, _ = np.argwhere(~np.isfinite(x))[0]
            raise _overflow(case, case.joints[joint].name, where(sample), "wrench")
    parts = [] if block.parts is None else [(name, block.parts[:, i]) for i, name in enumerate(EFFORT_PARTS)]
    for what, x in (("effort", block.tau), ("power", block.tau * block.v), *parts):
        if not np.isfinite(x).all():
            sample, column = np.argwhere(~np.isfinite(x))[0]
            raise _overflow(case, next(j.name for j in case.model.joints if j.v_index <= column < j.v_index + j.nv), where(sample), what)


def _all_finite(*arrays: np.ndarray) -> bool:
    """Whether all numbers are: a sum is finite only if every number is, and seldom overflows if none is huge."""
    return all(bool(np.isfinite(np.sum(x))) for x in arrays)


def _check_summary(case: LoadCase, rows: list[SummaryRow], balance: PowerBalance | None) -> None:
    """Refuses a summary that overflows: squares, integrals and energies may overflow even if wrenches don't."""
    for row in rows:
        for name, value in row.items():
            if isinstance(value, float) and not np.isfinite(value):
                raise _overflow(case, str(row["joint"]), "summary", name)
    if balance is not None and not (np.isfinite(balance.energy).all() and np.isfinite(balance.residual).all()):
        raise _overflow(case, "all joints", "power balance", "energy or power")


def _overflow(case: LoadCase, joint: str, where: str, what: str) -> MotionError:
    return MotionError(
        f"{case.motion_file or case.name}: {where}: {what} of {joint} is not finite; "
        "positions, rates, external wrenches or masses are too large: check their units (rad, m, s, N, N m, kg)"
    )
