"""Model, case and binding files: the keys of each, and how they are read and written."""
