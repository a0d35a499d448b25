"""A robot file as the rules of `ksl check` see it: read, however broken, with the findings in it, repaired and written.  It includes no rule.

Files: `robot.py`: what the rules see, filled in by `read_urdf.py`, `read_sdf.py`, `read_mjcf.py` from the XML (`xml_file.py`, `tags.py`, `vocabulary.py`);
`findings.py`, `repair.py`: what is wrong, and what is changed; `write.py`: the text of the repaired file.
"""
