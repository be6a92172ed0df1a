from .constraint_vector import ConstraintVector as ConstraintVector
from .manufacturability import KIND_NAMES as KIND_NAMES
from .manufacturability import Limits as Limits
from .manufacturability import margins as margins
