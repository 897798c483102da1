"""The keys of what a model file says once, and `expansion` writes out."""
