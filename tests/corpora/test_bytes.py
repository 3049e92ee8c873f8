"""The corpus `bytes` is as stored."""

from corpora.stored import as_stored

test_bytes_are_as_stored = as_stored("bytes")
