"""`ksl check`: rules that find what is wrong in a robot file, and the repair.  It includes `description/`, the file as the rules see it.

Files: `run.py`: all rules over a file, and its repair; `…_rules.py`: the rules by topic, each declared above its function (`rule.py`); `show.py`: the
findings as text.
"""
