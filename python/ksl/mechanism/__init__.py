"""Mechanisms: joints, links, states and requests, and the calls of all algorithms.

`mechanism.py`: joints, links, loops, sizes; `calls.py`: a method for each algorithm, generated; `requests.py`, `states.py`: its arguments as the extension takes them.
Kinds of joints: `joint_kinds.py`: what the compiled module says of them; `joint_columns.py`: tables whose columns have names of joints.
Loops: `loops.py`: the calls; `freedoms.py`, `chosen_coordinates.py`, `closed_reactions.py`.  `inverse_kinematics.py`.
Joints that give way: `stiffness.py`, `gear_classes.py`.
What people give: `given.py`: numbers, checked; `payload.py`; `lengths.py`: lengths in millimetres; `core_sentences.py`: what sentences of the compiled module are about.
"""
