"""Load cases: every wrench along a motion, tables of them, and their shares of limits.  Files that hold load cases are read above, in `case_files/`.

Files: every wrench along a motion: placement, blocks and tables, curves and quantities, limits; poses at rest; `computed_cases.py`: load cases with their
results; `reaction_joints.py`, `loop_motion.py`, `undetermined.py`: joints that close loops, and what rigid bodies leave open.
"""
