"""Models from files and texts: URDF, SDF, MJCF, USD, xacro; and files of loops and stiffness.

`loading.py`: `ksl.load`, which asks the root element for the reader; `read_options.py`: its options.  C++ reads URDF and SDF (src/load/).
MJCF: `load_mjcf.py`, with `mjcf_….py` for each part of a model; `mjcf_text.py` writes it.  USD: `usd/`, which is read as a graph of bodies first: `assembly.py`.
Beside a robot's file: `loops_file.py`, `stiffness_file.py`.  Programs that make it: `xacro_files.py`.  Meshes that it names: `mesh_files.py`.
"""
