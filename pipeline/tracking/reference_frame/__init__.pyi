from . import proposal as proposal
from .camera_calibration import CameraCalibration as CameraCalibration
from .camera_calibration import Setup as Setup
from .camera_calibration import calibrate as calibrate
from .recognition import ambiguous as ambiguous
from .recognition import check as check
from .recognition import recognised as recognised
