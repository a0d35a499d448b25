"""What runs write: results, the report as HTML, JSON and PDF; and the calls that make runs, `ksl.compute_loads` and `ksl.hold`.  It includes `html/`.

Files: `ksl.compute_loads`, `ksl.hold` and their `Run`, which writes results and report: `compute_loads.py`, `hold_pose.py`, `loads_run.py`,
`result_files.py`; the page of the report: `html/`; files that other programs read: `json_file.py`, `mat_file.py`, `mcap_file.py`, `workbook.py`, `pdf.py`; the run
of `ksl.compute_actuation`: `actuation_….py`.
"""
