"""A sensor is learned: what its touches tell of it, kept in a file beside its calibration.

::

    answering   which tactels never answer, or never let go
    tactels     gains, and where tips stand, from what recognised touches leave unexplained
    learn       touches -> `recognizer.touch.sensor_state.SensorState`, which the reader takes
    file        the state as JSON
    words       the state for people
    settings    every number that decides
"""
