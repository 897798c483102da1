"""Results of mutants as text, JSON and files for other tools."""
