"""What every package stands on; it imports nothing of this project.

::

    errors       the root of the errors, and how a missing extra is asked for
    console      how a command starts and ends
    output       results, messages and progress of a command
    files        files that are whole or not there
    cache        what takes long to compute, kept between runs
    document     files that people write: text, places, located problems
    yaml_tree    YAML -> values that remember their lines and columns
    settings     blocks of settings (pydantic), quantities, errors in plain words
    json_schema  the schema of such blocks
    compiled     loops compiled from C: where their library lies, and whether it may be used
    sensor_size  rows, columns and pitch of a sensor type, by name
"""
