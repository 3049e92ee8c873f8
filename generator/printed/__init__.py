"""G-code -> the surface that the beads leave: parts as a filament printer makes them.

::

    part's STL --slicer--> G-code --gcode--> Toolpath --faults--> Toolpath
        --beads, deposit--> Deposit --view (above | sideways)--> PrintedSurface
        --survey, check--> verdict on each symbol

A `PrintedSurface` is a grid of heights over a face, mm. Limits of the model stand in `beads`,
`faults` and `view`.
"""
