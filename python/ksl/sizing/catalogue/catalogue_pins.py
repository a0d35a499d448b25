"""Kinds of components of machines with pins and cylinders, and their catalogue numbers."""

from __future__ import annotations

from ksl.sizing.buckling import TETMAJER
from ksl.sizing.catalogue.catalogue_key import Key, ComponentKind

MOMENT = Key(
    "moment",
    "",
    "carried: the eye can't tilt and carries the joint's bending moment; none: it sits on a spherical plain bearing, or tilts freely",
    '"carried"',
    "word",
    default="carried",
    choices=("carried", "none"),
)
POSITION = Key("position", "m", "of its middle on the joint's axis, from the joint's origin", "0.0", sign="any", default=0.0)
LIFE = Key("required_life_h", "h", "life that is asked for; otherwise that at the top of the file", "8000")

PIN = ComponentKind(
    "pin",
    "of an eye between two cheeks, loose in both: bending, shear, bearing pressure",
    "any",
    (
        Key("diameter", "m", "of the pin", "0.08", needed=True),
        Key("inner_diameter", "m", "of a hollow one", "0", sign="not negative", default=0.0),
        Key("eye_width", "m", "of the part in the middle", "0.09", needed=True),
        Key("cheek_width", "m", "of each of the two outer parts", "0.04", needed=True),
        Key("gap", "m", "between the eye and each cheek", "0.002", sign="not negative", default=0.0),
        POSITION,
        MOMENT,
        Key("bending_stress", "Pa", "allowed", "200e6"),
        Key("shear_stress", "Pa", "allowed", "120e6"),
        Key("eye_pressure", "Pa", "allowed bearing pressure in the eye", "60e6"),
        Key("cheek_pressure", "Pa", "allowed bearing pressure in the cheeks", "90e6"),
    ),
)
BUSH = ComponentKind(
    "plain bush",
    "one on the joint's axis, or two with a spacing: specific pressure, speed, p·v, wear",
    "turning",
    (
        Key("diameter", "m", "bore", "0.08", needed=True),
        Key("width", "m", "of one bush", "0.06", needed=True),
        Key("spacing", "m", "from the middle of one bush to that of the other, if there are two", "0.3"),
        POSITION,
        MOMENT,
        Key("max_pressure", "Pa", "allowed specific pressure, static", "60e6"),
        Key("max_speed", "m/s", "allowed sliding speed", "1.0"),
        Key("max_pv", "W/m²", "allowed mean p·v, Pa · m/s", "1.5e6"),
        Key("max_pv_short", "W/m²", "allowed p·v of a sample", "3e6"),
        Key("wear_coefficient", "m³/(N m)", "k: worn depth over pressure and sliding distance", "1e-15"),
        Key("max_wear", "m", "depth that may wear off", "0.0005"),
        LIFE,
    ),
)
CYLINDER = ComponentKind(
    "hydraulic cylinder",
    "with one rod: pressures on both sides, buckling of the rod, stroke, flow",
    "sliding",
    (
        Key("bore", "m", "inner diameter of the tube", "0.1", needed=True),
        Key("rod_diameter", "m", "of the rod", "0.056", needed=True),
        Key("extends", "", "with positive or negative positions of the joint", '"positive"', "word", default="positive", choices=("positive", "negative")),
        Key("efficiency", "", "mechanical, 0 to 1: share of pressure times area that arrives at the rod", "0.95", default=1.0, largest=1.0),
        Key("back_pressure", "Pa", "on the side that lets oil out", "0.5e6", sign="not negative", default=0.0),
        Key("max_pressure", "Pa", "allowed on either side", "25e6"),
        Key("retracted_position", "m", "position of the joint where the cylinder is all in", "0.0", sign="any", default=0.0),
        Key("stroke", "m", "how far it comes out", "0.8"),
        Key("retracted_length", "m", "from pin to pin where it is all in", "1.2"),
        Key("buckling_factor", "", "β: buckling length over length, 1 for pins at both ends", "1", default=1.0),
        Key("rod_material", "", f"whose straight line of Tetmajer holds: {', '.join(TETMAJER)}", '"E335"', "word", default="E335", choices=tuple(TETMAJER)),
        Key("elastic_modulus", "Pa", "E of the rod", "2.1e11", default=2.1e11),
        Key("required_buckling_safety", "", "smallest critical force over pushing force that is accepted", "3.5", default=3.5),
        Key("max_flow", "m³/s", "allowed on either side", "0.002"),
        Key("max_speed", "m/s", "allowed speed of the rod", "0.5"),
    ),
)
