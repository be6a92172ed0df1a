from . import tracking_dots as tracking_dots
from .elastica import strip_between as strip_between
from .specimen_units import build_specimen as build_specimen
from .specimen_units import sort_shims as sort_shims
from .specimen_units import summary as summary
from .unit_bodies import end_angles as end_angles
from .unit_network import UnitNetwork as UnitNetwork
from .unit_network import network as network
