"""scbm: plan, run, test and cover behavior models of automation systems."""

__version__ = "0.1.0"
