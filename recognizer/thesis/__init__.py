"""The thesis's own way of reading: filters, edges, skeletons, the grid, a mosaic by product.

::

    image      frames -> one image, or a mosaic of several (product)
    filters    median, Sobel, background; edges/   lines of an image and its pose by them
    skeleton/  image -> strokes -> symbols
    grid       symbols -> rows and columns
    settings   the numbers that decide, one frozen value a stage
    read       window -> place of the database; scan   the same over a recording

Kept as published, to be compared with `recognizer.touch` and `recognizer.scan`. Thesis 4.3, 6,
appendix 3.
"""
