from .constraint_vector import ConstraintVector as ConstraintVector
from .manufacturability import Limits as Limits
from .manufacturability import margins as margins
from .slot_walls import slot_depth as slot_depth
