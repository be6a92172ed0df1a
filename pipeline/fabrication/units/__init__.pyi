from . import specimen_units as specimen_units
from . import tracking_dots as tracking_dots
from .unit_network import network as network
