"""What makers of bearings and gears ask for: how long a joint has which torque and speed, its rainflow matrices, and its bearing's loads in a few classes.

Files: `compute_spectra.py`: `ksl.spectra`; `spectra.py`: the distributions of one joint; `classes.py`: edges of classes; `bearing_classes.py`: the bearing's axes and
the reduction to a few classes; `spectra_of_joints.py`: several joints, as tables and files.
"""
