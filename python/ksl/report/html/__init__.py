"""The report's page, `report.html`, which the PDF prints as well: what it shows, and its sections.  It includes nothing of `report/`, which writes it.

Files: `input.py`: what a report shows; `page.py`: puts the sections together; `…_section.py`, `tables.py`: a section each; `charts.py`, `stills.py`: curves and
pictures; `numbers.py`, `rows.py`: numbers as they are shown; `assets/`: the template, its script and its style.
"""
