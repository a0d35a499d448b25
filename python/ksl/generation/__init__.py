"""Code of one mechanism (docs/c_code.md).

`recording.py`: algorithms recorded by src/generate/; `requests.py`: what is asked for; `arguments.py`: inputs besides those of rows;
`open_reactions.py`: what is refused of closed mechanisms; `c99.py`, `sine_cosine.py`: the printer of C; `files.py`: header, source,
CMakeLists.txt, README.md; `self_test.py`; `manifest.py`: library.json; `flash.py`: bytes on a microcontroller; `words.py`: names of a file in them; `rows.py`: what calls ask for, which follows from api/algorithms/.

Many states: `lanes.py`: the printer of vectors; `turning.py`: rows into lanes and back; `batches.py`: the loop over states; `lanes_files.py`: NAME_lanes.c.
CasADi: `casadi_blocks.py`: sparsity and Jacobians; `casadi_files.py`: NAME_casadi.c; `casadi_function.py`: `ksl.casadi_function`.
FMU: `fmus/`.
Graphics cards: `cuda/`: kernels; `card/`: calls of a model on arrays there.
`m.compile`: `compiled.py`, `compiler.py`, `cache.py`.
"""
