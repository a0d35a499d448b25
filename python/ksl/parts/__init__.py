"""Parts: from the wrench at a joint to the load case of the link that carries it.

`free_body.py`: a body with all that acts on it; `bodies.py`: those of a mechanism along a motion; `of_state.py`: of one state, `Model.free_bodies`;
`sources.py`: runs and results that they come from; `instants.py`, `hull.py`: which samples become cases; `compute_free_bodies.py`: `ksl.free_bodies`;
`cases.py`, `free_body_cases.py`: what it returns; `elements.py`, `mesh.py`: meshes of parts; `units.py`, `part_loads.py`: loads on a mesh in the units of a deck;
`calculix.py`, `nastran.py`: decks; `write.py`: all files.
"""
