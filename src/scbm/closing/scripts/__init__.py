"""Test cases for missing obligations, made from walks and injections."""
