"""`ksl` and `python -m ksl`."""

import sys


def main() -> None:
    """Runs the command line; says what is missing where the extra `loads` is not installed."""
    try:
        from ksl.commands import app
    except ModuleNotFoundError as e:
        if e.name not in ("typer", "rich"):
            raise
        sys.exit("ksl: the command needs the extra packages of ksl[loads]; install them with: pip install 'ksl[loads]'")
    except KeyboardInterrupt:  # before there is a command that could say so
        sys.exit(130)
    try:
        app(prog_name="ksl")
    except KeyboardInterrupt:  # before or after the command itself
        sys.exit(130)


if __name__ == "__main__":
    main()
