from . import dic_points as dic_points
from . import track_table as track_table
from .dic_points import Points as Points
from .track_dataset import absent as absent
from .track_dataset import assemble_track as assemble_track
from .track_dataset import is_driven as is_driven
from .track_dataset import labelled as labelled
from .track_dataset import mean_seen as mean_seen
