"""Small motions about a pose: how joints give way, frequencies and shapes, compliances and deflections, equilibria, linear models.

`giving_way` ← `directions` ← `second_derivatives`, `closure` ← `elastic` ← `modes`, `compliance`; `equilibrium` and `linearise` need no stiffnesses of joints.
"""
