"""The same robot in other libraries: `ksl.compare`.

Files: `ksl.compare`, `compare_robot.py`: the robot in other libraries. `other_robot.py`: what a library's file (`with_….py`) fills in; `coordinates.py`:
numbers of joints in other layouts; `hypotheses.py`, `kinematic_reasons.py`, `body_changes.py`: why numbers differ, each tried
(docs/decisions/0022-comparison.md).
"""
