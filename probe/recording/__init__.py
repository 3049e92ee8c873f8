"""Recordings: HDF5 files of frames, safe against a crash."""
