"""`ksl check`: rules that find what is wrong in a robot file, the findings, and the repair."""
