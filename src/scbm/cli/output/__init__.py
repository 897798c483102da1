"""Output of verbs: lines, JSON and progress on the terminal, and how one run is shown."""
