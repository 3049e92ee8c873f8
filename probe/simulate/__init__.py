"""Simulated touches of registered faces and of written parts.

::

    target      a word -> the surface that it names: registered, part, round, scene
    touch       touches at random, and where a touched sensor stands
    simulation  target + options -> touches with their frames and their truth
    source      what stands behind `sim:` ports: a probe that keeps touching
"""
