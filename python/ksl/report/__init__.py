"""What runs write: results, the report as HTML, JSON and PDF; and the calls that make runs, `ksl.compute_loads` and `ksl.hold`."""
