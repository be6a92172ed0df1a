from . import compiling as compiling
from .arrays import Floats as Floats
from .arrays import Ints as Ints
from .arrays import Numbers as Numbers
from .compiling import compiled as compiled
from .compiling import inlined as inlined
from .errors import NewContactPairs as NewContactPairs
from .errors import SimulationError as SimulationError
