"""Forward models: surface, overlay, force, wrist -> force on each tactel (Thesis 4.2)."""
