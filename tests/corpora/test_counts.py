"""The corpus `counts` is as stored."""

from corpora.stored import as_stored

test_counts_are_as_stored = as_stored("counts")
