from .video_tracking import Track as Track
from .video_tracking import track_video as track_video
