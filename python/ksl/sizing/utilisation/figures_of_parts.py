"""The figures of each kind of component, and the joints that it can sit on."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from ksl.base.errors import SizingError
from ksl.sizing.utilisation.bearing_figures import crossed_roller_figures, opposed_figures, pair_figures
from ksl.sizing.utilisation.bolt_figures import flange_figures
from ksl.sizing.catalogue.catalogue_key import ComponentKind
from ksl.sizing.catalogue.parts import Components, Part
from ksl.sizing.utilisation.cylinder_figures import cylinder_figures
from ksl.sizing.utilisation.fatigue_figures import fatigue_figures
from ksl.sizing.utilisation.gear_figures import planetary_figures, strain_wave_figures
from ksl.sizing.utilisation.limit_figures import limit_figures
from ksl.sizing.utilisation.motor_figures import Cloud, motor_figures
from ksl.sizing.utilisation.pin_figures import bush_figures, pin_figures
from ksl.sizing.results import Results
from ksl.sizing.samples import JointSamples
from ksl.sizing.utilisation.sheet import Demands, Sheet

FIGURES: dict[str, Callable[[Sheet], Cloud | None]] = {
    "motor": motor_figures,
    "strain wave gear": strain_wave_figures,
    "planetary gear": planetary_figures,
    "crossed roller bearing": crossed_roller_figures,
    "bearing pair": pair_figures,
    "opposed angular contact bearings": opposed_figures,
    "bolted flange": flange_figures,
    "pin": pin_figures,
    "plain bush": bush_figures,
    "hydraulic cylinder": cylinder_figures,
    "fatigue": fatigue_figures,
    "limits": limit_figures,
}
"""What adds the figures of each kind of component."""

WRENCH = ("axial_force", "radial_force", "bending_moment", "axial_moment")
USES = {
    "motor": (), "strain wave gear": (), "planetary gear": (), "hydraulic cylinder": (),
    "crossed roller bearing": WRENCH[:3], "bearing pair": WRENCH[:3], "opposed angular contact bearings": WRENCH[:3],
    "bolted flange": WRENCH, "fatigue": WRENCH, "pin": WRENCH[1:3], "plain bush": WRENCH[1:3],
}  # fmt: skip
"""The quantities of the wrench that the figures of each kind use: those that rigid bodies leave open get no verdict."""

GEARS = ("strain wave gear", "planetary gear")
DRIVES = ("motor", *GEARS, "hydraulic cylinder")


def demands_of(parts: Components) -> Demands:
    """What a file asks of all components."""
    return Demands(parts.required_life_h, parts.reliability, parts.edition, bool(parts.spectrum.shares))


def gears_of(parts: Iterable[Part]) -> dict[str, Part]:
    """The gear on each joint, the first one: motors without a ratio have its."""
    gears: dict[str, Part] = {}
    for part in parts:
        if part.kind.name in GEARS:
            gears |= {joint: part for joint in part.joints if joint not in gears}
    return gears


def sheet_of(part: Part, samples: JointSamples, demands: Demands, gear: Part | None) -> tuple[Sheet, Cloud | None]:
    """The figures of a component on a joint, and of motors their torque over speed.  gear: the one on the same joint."""
    sheet = Sheet(part, samples, demands, gear)
    sheet.uses = USES.get(part.kind.name, WRENCH)
    if part.kind.name in DRIVES and not (samples.supplied == samples.supplied).all():  # NaN where there is none
        sheet.leave_out("everything", f"{samples.joint.name} has no drive in these results: it follows other joints")
        return sheet, None
    return sheet, FIGURES[part.kind.name](sheet)


def check_kind(table: Results, kind: ComponentKind, name: str, where: str) -> None:
    """Refuses a component of a kind that can't sit on a joint."""
    joint = table.joints[name]
    fits = {"turning": joint.turns, "sliding": joint.driven and not joint.turns, "driven": joint.driven, "any": True}
    if not fits[kind.joints]:
        sits = {"turning": "turns about one axis", "sliding": "slides along one axis", "driven": "has one coordinate"}[kind.joints]
        raise SizingError(f"{where}: a {kind.name} sits on a joint that {sits}, and {name} is {joint.kind}; `limits` and `bolted flange` take any joint")


def check_joints(table: Results, parts: Iterable[Part]) -> None:
    """Refuses components on joints where they can't sit."""
    taken: dict[tuple[str, str, str], Part] = {}
    for part in parts:
        for name in part.joints:
            check_kind(table, part.kind, name, part.where)
            key = (name, part.kind.name, part.name)
            if key in taken:
                raise SizingError(f"{part.where}: {name} has two components of kind {part.kind.name} named {part.name!r}; give each a name")
            taken[key] = part
