"""Named columns of numbers: which of them are used, what they mean, and their units."""
