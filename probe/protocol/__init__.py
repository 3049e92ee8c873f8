"""Packets on the wire: COBS, CRC16-CCITT, frames, ident, statistics."""
