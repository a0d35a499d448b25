"""The file of components: which parts carry which joint, and their numbers, judged as they are read."""
