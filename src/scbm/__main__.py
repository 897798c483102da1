"""`python -m scbm` is `scbm`."""

from scbm.cli import main

main()
