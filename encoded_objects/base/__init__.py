"""What every package stands on; it imports nothing of this project.

::

    errors       the root of the errors, and how a missing extra is asked for
    document     files that people write: YAML with marks, quantities, located problems
    console      how a command starts, shows progress, writes files and ends
    compiled     loops compiled from C: where their library lies, and whether it may be used
    sensor_type       matrix, overlay and values of a sensor, and which type images are of
    sensor_type_file  types by name and as YAML; `sensor_types` holds the shipped ones
"""
