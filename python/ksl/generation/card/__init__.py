"""Calls of a model on arrays in a graphics card's memory (docs/card.md).

`driver.py`: CUDA's driver, by ctypes; `arrays.py`: arrays of torch, CuPy, Numba and others, as rows; `dlpack.py`: those that have DLPack's protocol alone;
`functions.py`: machine code in the cache, on cards, and launches; `calls.py`: which call of a model is which function; `compiled.py`: `m.compile(…, device="cuda")`.
"""
