"""Sizing: motors, gears, bearings, bolts and fatigue of every joint under the wrenches that `ksl loads` writes.

`compute_sizing.size` (public as `ksl.size`) reads results and a file of components and returns the figures.  The formulas are plain
functions of arrays, a file for each topic: motor, gears, life, bearings, bearing_pair, bolts, fatigue.

Files: `ksl.size`, `compute_sizing.py`: formulas of motors, gears, bearings, bolts and fatigue; `bolt_names`, `bolt_strength`, `bolt_numbers`: bolts by name;
`pins`, `buckling`: pins, bushes, rods of cylinders; `catalogue`, `catalogue_key`, `catalogue_pins`, `catalogue_numbers`, `components`: the components file;
`reader`, `parts`: its checks and what it holds; `figures_of_parts`: which figures each kind has; `given`, `provenance`: what sizing is given and made of;
`choice/`: a choice from a catalogue; `bearing_ratings`: ratings from dimensions; `spectra/`: `ksl.spectra`, load spectra; `results`, `samples`: wrenches of each joint; `*_figures`: utilisations.
"""
