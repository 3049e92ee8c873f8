"""Plane geometry, the same for every stage: sides, areas, crossings, distances."""
