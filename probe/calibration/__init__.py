"""Counts -> newtons: bias, bad tactels, the force law of each tactel."""
