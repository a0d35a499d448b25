"""Sizing: motors, gears, bearings, bolts and fatigue of every joint under the wrenches that `ksl loads` writes.  It includes none of the rooms in it.

The formulas are plain functions of arrays, a file for each topic: `motor`, `gears`, `life`, `bearings`, `bearing_pair`, `bearing_ratings`, `bolts`, `bolt_names`,
`bolt_strength`, `pins`, `buckling`, `fatigue`; `results`, `samples`, `peaks`: wrenches of each joint; `figures`: numbers with a limit.

Rooms: `catalogue/`: the components file; `utilisation/`: figures of each component; `choice/`: a choice from a catalogue; `spectra/`: `ksl.spectra`;
`joints/`: `ksl.size`, which puts them together.
"""
