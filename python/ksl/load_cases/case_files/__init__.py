"""Load cases as users give them: by a file of cases, or by arguments of calls.  It includes `load_cases/`, which includes nothing of it.

Files: `case_file.py`, `case_values.py`: the TOML file, its values; `case_mechanism.py`: what it says of loops; `simulate_keys.py`, `simulated.py`: motions that are simulated; `stops.py`:
emergency stops; `wrenches_over_time.py`; `given_cases.py`, `motion_given.py`: what calls are given; `results_model.py`: the robot that results name.
"""
