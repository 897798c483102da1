"""Sets of all situations of runs as decision diagrams, where situations are too many for a graph."""
