"""`python -m viscopade` is the command line."""

from viscopade.cli.main import main

main()
