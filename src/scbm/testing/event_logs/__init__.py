"""Event logs of runs over nodes: the events of a run, from which its trace is replayed and judged."""
