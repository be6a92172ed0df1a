from .rigid_patch import Patch as Patch
from .rigid_patch import find_motion as find_motion
from .rigid_patch import fit_motion as fit_motion
from .rigid_patch import follow_patch as follow_patch
from .rigid_patch import moved_outline as moved_outline
from .rigid_patch import square as square
from .video_tracking import Track as Track
from .video_tracking import track_video as track_video
