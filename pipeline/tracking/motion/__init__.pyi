from .track_video import Track as Track
from .track_video import follow as follow
