"""All runs of a model as a graph: situations, events between them, walks."""
