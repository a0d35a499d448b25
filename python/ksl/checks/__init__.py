"""`ksl check`: rules that find what is wrong in a robot file, the findings, and the repair.

Files: `run.py`: all rules over a file, and its repair; `robot.py`: a file as the rules see it, however broken, filled in by `read_urdf.py`, `read_sdf.py`,
`read_mjcf.py`; `…_rules.py`: the rules by topic, each declared above its function (`rule.py`); `findings.py`, `show.py`: the findings, and as text.
"""
