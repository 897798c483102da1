"""The verbs of the command line: one module for each, whose function `command` returns an exit code."""
