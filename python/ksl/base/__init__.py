"""What every other package stands on: errors, limits, files that users name, text for terminals and tables, numbers as arrays."""
