"""What every package stands on; it imports nothing of this project.

::

    errors       the root of the errors, and how a missing extra is asked for
    document     files that people write: YAML with marks, quantities, located problems
    console      how a command starts, shows progress, writes files and ends
    compiled     loops compiled from C: where their library lies, and whether it may be used
    sensor_size  rows, columns and pitch of a sensor type, by name
"""
