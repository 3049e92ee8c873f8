"""The thesis's own way of reading: filters, edges, skeletons, the grid, a mosaic by product.

::

    merge      frames -> one image of several touches (product)
    filters    median, Sobel, background
    edges      image -> lines and corners;  edge_fit   edges of one touch, refined
    skeleton   ink -> end-points and vertices;    symbols   image -> symbols
    grid       symbols -> rows and columns
    read       window -> place of the database;   scan      a recording

Kept as published, to be compared with `recognizer.touch` and `recognizer.scan`. Thesis 4.3, 6,
appendix 3.
"""
