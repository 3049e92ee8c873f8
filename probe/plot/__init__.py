"""Pictures of frames and touches, loaded when one is asked for. PNG, the same bytes every time."""
