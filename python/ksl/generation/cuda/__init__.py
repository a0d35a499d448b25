"""Kernels of one mechanism for a graphics card (docs/card.md).

`kernels.py`: what a kernel takes, and their text; `device.py`: functions of one state; `order.py`: the order of their steps; `turning.py`: rows in and out of threads;
`simulation.py`: many steps in one kernel; `files.py`: NAME.cuh, NAME.cu; `nvrtc.py`: NVIDIA's compiler; `figures.py`: registers, as it says them.
"""
