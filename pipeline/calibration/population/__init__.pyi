from .validation_study import BEYOND as BEYOND
from .validation_study import draw_constants as draw_constants
from .validation_study import validate_population as validate_population
