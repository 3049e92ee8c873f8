"""Symbols by their end-points and vertices, as the thesis reads them. Thesis 6.1, 6.2.

ink        image -> where strokes are felt
graph      skeleton -> ends, junctions and the lines between them, spurs pruned
count      end-points and vertices of a skeleton, and of a glyph
symbols    the counts' symbol, its centre and axes, or why there is none
"""
