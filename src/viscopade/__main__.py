"""Entry point of the command line, also of `python -m viscopade`. Ctrl-C works even while modules are imported."""

import sys


def main() -> None:
    """Run the command line; an interruption exits with status 130 (128 and the number of SIGINT, 2)."""
    # The import takes a part of a second, during which Ctrl-C would print a traceback.
    try:
        from viscopade.cli import main
    except KeyboardInterrupt:
        sys.stderr.write("\nviscopade: interrupted\n")
        sys.exit(130)
    main.main()


if __name__ == "__main__":
    main()
