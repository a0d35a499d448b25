"""Load cases: every wrench along a motion, tables of them, and their shares of limits.  Files that hold load cases are read above, in `case_files/`.

From a motion to results: `load_case.py`: a motion of a model, and its wrenches block by block, as `placement.py` says; `curves.py`: the curves of each joint that blocks
make; `quantities.py`: rows of the summary and the power balance of curves; `verdict.py`, `joint_limits.py`: shares of limits; `case_result.py`: these together, of one
load case; `computed_cases.py`: of all, with `ranking.py`: which matter most.

Tables: `wrench_table.py`, `summary_table.py`, what made them, `provenance.py`, and `results_table.py`, which reads them again.
Closed mechanisms: `closed_mechanism.py`; `reaction_joints.py`, `loop_motion.py`, `passive_joints.py`: joints that close loops, and those without a motor; `undetermined.py`: what rigid bodies
leave open.  Poses at rest: `poses.py`, `closed_poses.py`, `holding.py`.  `force_elements.py`: what springs, dampers and cylinders do.
"""
