"""The command line: a module for each verb, which parses options, calls the packages below and shows the result."""

from scbm.cli.main import main

__all__ = ["main"]
