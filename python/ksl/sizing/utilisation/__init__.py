"""Utilisations of components under the wrenches of their joints.  It includes the formulas, `sizing/`, and the components, `catalogue/`.

Files: `…_figures.py`: the figures of a kind of component; `figures_of_parts.py`: which figures each kind has; `sheet.py`: collects those of one component.
"""
