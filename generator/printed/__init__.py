"""G-code -> the surface that the beads leave: parts as a filament printer makes them."""
