from . import calibration_dataset as calibration_dataset
from . import computed_sets as computed_sets
from .fit_constants import fitted as fitted
from .fit_constants import unsimulated as unsimulated
