"""Models that check others and that no command needs: finite elements of round tabs and pads."""
