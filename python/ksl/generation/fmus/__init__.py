"""`ksl.fmu`: a mechanism as a unit for co-simulation, FMI 3.0 (docs/c_code.md).

`fmu.py`: the call, and the archive; `fmu_variables.py`: names, units, starts; `fmu_description.py`: its XML; `open_states.py`: what closes loops after a step;
`fmu_model.py`: what `fmi3/`, C that is the same for all mechanisms, needs to know of one.
"""
