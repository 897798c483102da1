"""Campaigns in batches: ranges of case numbers that run in any process, and summaries that merge in order."""
