"""Test cases for missed obligations, made from walks and injections."""
