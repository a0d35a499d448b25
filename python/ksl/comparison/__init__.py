"""The same robot in other libraries: `ksl.compare`."""
