"""What runs write: results, the report as HTML, JSON and PDF; and the calls that make runs, `ksl.loads` and `ksl.hold`."""
