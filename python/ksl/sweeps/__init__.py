"""Sweeps: one load case in thousands of variants, computed by processes or by a Ray cluster.

Files: `ksl.sweep`, `compute_sweep.py`: `description.py`, `sampling.py`, `variants.py`: the cases; `evaluate.py`, `joint_summaries.py`: one partition;
`local.py`, `on_ray.py`: who computes them; `store.py`: the folder (docs/decisions/0011-sweeps.md).
"""
