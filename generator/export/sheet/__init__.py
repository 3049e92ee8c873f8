"""The build sheet: what is printed, how it lies, how it is put together, how it is checked.

::

    drawing.py   parts, plates and steps of gluing -> SVG
    values.py    what a sheet says
    page.py      values -> one HTML file that needs no network
"""
