"""What `encoded_objects` loads when it is first used, for type checkers and editors."""

from decoder.any_method import decode as decode
from encoded_objects.base.errors import EncodedObjectsError as EncodedObjectsError
from encoded_objects.base.sensor_type import SensorType as SensorType
from generator.cad.encode import encode as encode
from probe.frame import Frame as Frame
from probe.recording.read import Recording as Recording
from probe.simulate.simulation import simulate as simulate
from recognizer.scan.session import Scan as Scan
from recognizer.touch.lab import open_lab as open_lab
from recognizer.touch.reader import Reader as Reader
from recognizer.touch.recognition import Recognition as Recognition
from recognizer.validation.pipeline import validate as validate

__version__: str
