"""Where every symbol stands: unfold, choose lattices, place faces on the array."""
