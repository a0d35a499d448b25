"""Drivetrains through loops: the rods of ankles, four-bars of knees and differentials that stand between motors and joints.

`parts` finds the mechanism that moves some joints, `idle` its rods that turn about their own lines; `equations` are those of its loops, and `assembly`
follows them from a start.  `motion`, `efforts` and `actuation` are the calls of a map, a class each.  `boxes`, `ranges` and `region` say what limits leave, `rods_cut`,
`least_squares` and `serial` make the tree for simulators; `loop_rows`, `elimination` and `recorded_maps` record the maps, of which `c_maps` writes C for firmware and
`compiled_maps` makes code for batches; `swings` are limits of balls; `judged_limits` holds files' limits against the true ones.
"""
