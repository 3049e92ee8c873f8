"""Exploring a face by touch: where to press, how to get there, where one was. Thesis 4.3.

    raster         polygon of a face -> places that overlap by 75 %
    approach       move until a force is felt, never harder than allowed
    kinesthetic    what arm and wrist believe, and what is true, with backlash and noise
    places         pose of the sensor over a surface <-> touch of the contact models

mm, rad, N. Every touch of a scan: move over the place, `approach`, take a frame, lift.
"""
