"""One run as a file for trace viewers."""
