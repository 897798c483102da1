"""The command line. One module for each verb; each says what it takes, asks other rooms, and draws the answer."""

from scbm.cli.main import main

__all__ = ["main"]
