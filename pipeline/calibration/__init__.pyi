from . import calibration_dataset as calibration_dataset
from . import computed_sets as computed_sets
from .fit_constants import fit_calibration as fit_calibration
from .fit_constants import simulation_fault as simulation_fault
from .load_cycle_study import study_cycles as study_cycles
from .picture_study import numbered_pictures as numbered_pictures
from .picture_study import study_pictures as study_pictures
from .picture_study import tracked_parts as tracked_parts
