from .laser_sheets import LaserSheet as LaserSheet
from .laser_sheets import sheets as sheets
from .packing import Spot as Spot
from .packing import TooLargeError as TooLargeError
from .packing import pack as pack
from .print_plates import plates as plates
