"""Cutting the stream: every split gives the same blocks, and memory is bounded."""

from probe.protocol import LONGEST, Splitter


def test_blocks_end_at_zeros():
    splitter = Splitter()
    assert splitter.feed(b"ab") == []
    assert splitter.feed(b"c\0\0de\0f") == [b"abc", b"de"]
    assert splitter.feed(b"\0") == [b"f"]
    assert splitter.feed(b"") == []


def test_a_block_without_end_is_cut_and_stays_too_long():
    splitter = Splitter()
    for _ in range(LONGEST // 50_000 + 2):
        assert splitter.feed(b"x" * 50_000) == []
        assert len(splitter._rest) <= LONGEST + 1
    (block,) = splitter.feed(b"\0")
    assert len(block) == LONGEST + 1
    assert splitter.feed(b"good\0") == [b"good"]
