"""Entry point of `python -m viscopade`: the command line."""

from viscopade.cli.main import main

main()
