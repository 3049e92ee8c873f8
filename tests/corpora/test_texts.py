"""The corpus `texts` is as stored."""

from corpora.stored import as_stored

test_texts_are_as_stored = as_stored("texts")
