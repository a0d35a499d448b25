"""What runs write: results, the report as HTML, JSON and PDF; and the calls that make runs, `ksl.compute_loads` and `ksl.hold`.

Files: `ksl.compute_loads`, `ksl.hold` and their `Run`, which writes results and report: `compute_loads.py`, `hold_pose.py`, `loads_run.py`,
`result_files.py`. The report as HTML, JSON and PDF: `input.py` says what it shows, `page.py` puts the sections together, each of which has a file.
"""
