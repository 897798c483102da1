"""PDDL that others wrote: domains and problems as model files."""
