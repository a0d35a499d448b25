"""What every other package stands on: errors, limits, files that users name, text for terminals and tables, numbers as arrays.

Files: errors, limits of files, files that people write, names on their way to terminals, tables (`csv_cells.py`) and pages (`markup.py`), what counts as
numbers; `judged.py`: bounds of quantities that files give; `other_names.py`: calls that other libraries have; `higher_rooms.py`: methods of models that
higher rooms compute.
"""
