"""What every package stands on; it imports nothing of this project.

::

    errors            the root of the errors, and how a missing extra is asked for
    console           how a command starts and ends
    output            results, messages and progress of a command
    files             files that are whole or not there
    cache             what takes long to compute, kept between runs
    document          files that people write: text, places, located problems
    yaml_tree         YAML -> values that remember their lines and columns
    settings          blocks of settings (pydantic), quantities, errors in plain words
    json_schema       the schema of such blocks
    pages        HTML by Jinja2 templates
    compiled          loops compiled from C: where their library lies, and whether it may be used
    options           options of commands, each declared once
    sensor_type       matrix, overlay and values of a sensor, and which type images are of
    sensor_type_file  types by name and as YAML; `sensor_types` holds the shipped ones
"""
