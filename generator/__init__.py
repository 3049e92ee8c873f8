"""Spec -> array -> layout -> solid -> files + database."""
