"""The state of a sensor is learned from its touches and kept in a file next to its calibration.

learn    touches -> `recognizer.touch.sensor_state.SensorState`, which the reader takes
file     the state as JSON, as text, and as numbers for `--json`
wiring   readings at other places: reported on refusals, undone on request; the mounting
"""
