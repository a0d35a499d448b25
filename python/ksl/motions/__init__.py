"""Motions: read from files and arrays, differentiated; what they say of themselves; motions that programs make.

Files: `motion.py`, `reading.py`: motions, read and differentiated; `closing.py`, `closed_motion.py`: joints that follow by loops; `files/`: readers by
format, which the content tells (`recognise.py`); `columns/`: which columns are used, and their units; `signal/`: splines and rates, jumps, noise, gaps, the
filter, where joints stand (docs/decisions/0015-stands.md), what is doubtful; `generate/`: motions that programs make.
"""
