"""Simulated touches of registered faces and of written parts.

::

    target      a word -> the surface that it names: registered, part, round, scene
    touch       touches at random, and where a touched sensor stands
    scan        places one after the other on a way over a face, as a robot goes it
    simulation  target + options -> touches with their frames and their truth
    source      what stands behind `sim:` ports: a probe that keeps touching
    world       how sensors, prints and surfaces are off: levels, wear, surfaces of nobody
"""
