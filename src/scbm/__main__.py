"""The entry point of the script `scbm` and of `python -m scbm`: it handles Ctrl-C while the command line is loaded."""

import sys


def main() -> None:
    """Run `scbm`, and exit with its code; exit with 130 if Ctrl-C comes before `scbm.cli` handles it itself."""
    try:
        from scbm.cli import main as run_command_line  # noqa: PLC0415 - this import is what Ctrl-C may interrupt

        run_command_line()
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
