from .constraint_vector import ConstraintVector as ConstraintVector
from .manufacturability import Limits as Limits
from .manufacturability import margins as margins
from .straight_slots import slot_depth as slot_depth
