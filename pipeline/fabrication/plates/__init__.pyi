from .layouts import MITRE as MITRE
from .layouts import LaserSheet as LaserSheet
from .layouts import laser_sheets as laser_sheets
from .layouts import print_plates as print_plates
from .packing import Spot as Spot
from .packing import TooLargeError as TooLargeError
from .packing import pack as pack
