"""Sensor types by name and from files. Thesis 3.3.

::

    settings    what a file of a sensor type may say (pydantic), and its JSON schema
    read        name or file -> SensorType; errors at line and column
    text        SensorType -> the text of a file
    choose      which type a recording or a port is of: asked for, told, or the usual one
    propose     the pitch of symbols that a type reads best
    force       how hard it is pressed, beside the usual one
    shipped/    the types that come with the package, a YAML file each

`read` loads pydantic and the YAML reader; what stands here loads it where a type is asked for.
"""

from probe.sensor_types.choose import choose_sensor_type
from probe.sensor_types.errors import SensorTypeError
from probe.sensor_types.force import force_share, usual_force_n
from probe.sensor_types.propose import proposed_pitch_mm
from probe.sensor_types.text import sensor_type_text

__all__ = [
    "SensorTypeError",
    "choose_sensor_type",
    "force_share",
    "proposed_pitch_mm",
    "sensor_type_text",
    "usual_force_n",
]
