"""Checks of a domain and a problem of PDDL: brackets, sections, names, types, and numbers of arguments."""
