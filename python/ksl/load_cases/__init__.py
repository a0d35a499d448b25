"""Load cases: every wrench along a motion, tables of them, and their shares of limits.

Files: every wrench along a motion: placement, blocks and tables, curves and quantities, limits; poses at rest; `computed_cases.py`: load cases with their
results; `case_mechanism.py`: what they say of loops; `simulated.py`, `simulate_keys.py`: motions that are simulated; `reaction_joints.py`, `loop_motion.py`,
`undetermined.py`: joints that close loops, and what rigid bodies leave open.
"""
