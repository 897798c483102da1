"""Proofs that no run visits an obligation, and their certificates."""
