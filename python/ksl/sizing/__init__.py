"""Sizing: motors, gears, bearings, bolts and fatigue of every joint under the wrenches that `ksl loads` writes.

`compute_sizing.size` (public as `ksl.size`) reads results and a file of components and returns the figures.  The formulas are plain
functions of arrays, a file for each topic: motor, gears, life, bearings, bearing_pair, bolts, fatigue.
"""
