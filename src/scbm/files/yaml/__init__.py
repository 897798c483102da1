"""YAML with places: text to nodes that know their line and column, edits, and writing."""
