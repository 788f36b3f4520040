"""`python -m viscopade` is the command line."""

from viscopade.cli import main

main()
