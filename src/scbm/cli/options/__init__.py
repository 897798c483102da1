"""Options that several verbs share, and the parsing of their values."""
