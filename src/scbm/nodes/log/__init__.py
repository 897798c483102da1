"""Event logs: everything that a real run was given, written and replayed."""
