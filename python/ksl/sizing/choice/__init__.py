"""A choice from a catalogue: which entries hold on each joint, and what their masses do to the loads.

Files: `offers`: the catalogue; `robot_of_results`, `loads_with_masses`: loads as functions of the masses that are chosen; `judge`: which entries hold;
`choose`: round after round until nothing changes; `together`: the best of all combinations, where they are few; `selection`: the result.
"""
