"""Entry point of the command line, also of `python -m viscopade`. Ctrl-C works even while modules are imported."""

import sys


def main() -> None:
    """Run the command line."""
    try:
        from viscopade.cli import main
    except KeyboardInterrupt:
        sys.stderr.write("\nviscopade: interrupted\n")
        sys.exit(130)
    main.main()


if __name__ == "__main__":
    main()
