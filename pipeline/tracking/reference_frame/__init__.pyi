from . import proposal as proposal
from .camera_calibration import CameraCalibration as CameraCalibration
from .camera_calibration import RecordingSetup as RecordingSetup
from .camera_calibration import calibrate_camera as calibrate_camera
from .recognition import ambiguity_text as ambiguity_text
from .recognition import check_outlines as check_outlines
from .recognition import recognise as recognise
