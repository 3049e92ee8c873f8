"""The corpus `answers` is as stored."""

from corpora.stored import as_stored

test_answers_are_as_stored = as_stored("answers")
