"""Algorithms with their derivatives, for libraries of arrays that differentiate: one table of operators, and a file for each library.

:mod:`ksl.torch` and :mod:`ksl.jax` are what users import.

Files: calls that torch and JAX differentiate: `table.py`: a row for each; `operator.py`: one of a model, and shapes; `calls.py`: what users call;
`torch_arrays.py`, `jax_arrays.py`: the rules of each library.
"""
