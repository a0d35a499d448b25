"""`ksl.size`: the sizing of every joint.  It includes all other rooms of `sizing/`.

Files: `compute_sizing.py`: the call; `sizing.py`: its result.
"""
