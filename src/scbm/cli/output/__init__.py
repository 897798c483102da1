"""Terminal output, files that verbs write, and exit codes."""
