"""A sensor is learned: what its touches tell of it, kept in a file beside its calibration.

::

    answering   which tactels never answer, or never let go
    tactels     gains, and where tips stand, from what recognised touches leave unexplained
    learn       touches -> `recognizer.touch.sensor_state.SensorState`, which the reader takes
    file        the state as JSON
    mounting    a touch placed by hand -> how the sensor is mounted
    wiring      readings that arrive in other places: said on refusals, undone on request
    words       the state for people
    settings    every number that decides
"""
