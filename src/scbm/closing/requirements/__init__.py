"""Built-in requirements of all runs: proved, or violated by a case (decision 53)."""
