"""Which states a system of moves can reach, and how far each is from a goal; exactly, and for all states at once."""
