"""Keys of components that say how they give way: what `--stiffness` takes of a components file."""

from __future__ import annotations

from ksl.sizing.catalogue.catalogue_key import Key

K1 = Key("K1", "N m/rad", "torsional stiffness at the output, up to the torque T1", "1.2e4")
CLASSES = (
    K1,
    Key("T1", "N m", "where K2 begins", "14"),
    Key("K2", "N m/rad", "torsional stiffness between T1 and T2", "1.8e4"),
    Key("T2", "N m", "where K3 begins", "48"),
    Key("K3", "N m/rad", "torsional stiffness beyond T2", "2.4e4"),
)
TORSION = (Key("torsional_stiffness", "N m/rad", "at the output", "3e4"),)
AXIAL = Key("axial_stiffness", "N/m", "along the axis, at the working load", "4e7", sign="not negative")
RADIAL = Key("radial_stiffness", "N/m", "across the axis", "6e7", sign="not negative")
TILTING = Key("tilting_stiffness", "N m/rad", "about the middle of the rollers", "9e4", sign="not negative")
INTERFACE = (
    Key("axial_stiffness", "N/m", "of the bolted interface along its normal", "2e9"),
    Key("radial_stiffness", "N/m", "in its plane", "1e9"),
    Key("tilting_stiffness", "N m/rad", "about axes in its plane", "4e6"),
    Key("torsional_stiffness", "N m/rad", "about its normal", "3e6"),
)
OF_STIFFNESS = {key.name for key in (*CLASSES, *TORSION, AXIAL, RADIAL, TILTING, *INTERFACE)}
