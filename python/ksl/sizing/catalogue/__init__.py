"""The file of components: which parts carry which joint, and their numbers, judged as they are read.  It includes the formulas, `sizing/`.

Files: `components.py`, `reader.py`, `parts.py`: the file, its checks and what it holds; `catalogue….py`, `bolt_numbers.py`: kinds and their keys; `requests.py`:
what is to be chosen; `component_stiffness.py`: how joints give way by components; `given.py`, `provenance.py`: what sizing is given and made of; `example.py`.
"""
