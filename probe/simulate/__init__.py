"""Simulated touches of registered faces and of written parts.

::

    scene       a surface, where on it a sensor may stand, whose it is; touches at random
    target      a word -> scene: a face of a database (registered), a written part (written)
    sensor      scene + touch -> contact and counts, frame after frame
    scan        places one after the other on a way over a face, as a robot goes it
    simulation  target + options -> touches with their frames and their truth
    source      frames of `sim:` ports: a probe that keeps touching
    printed     what PrusaSlicer's G-code leaves of a registered part
    world       sensors, prints and surfaces as they are: levels, wear, foreign surfaces
"""
