from . import dic_points as dic_points
from .dic_points import DicExport as DicExport
from .track_dataset import absent_flag as absent_flag
from .track_dataset import assemble_track as assemble_track
from .track_dataset import drive_displacement as drive_displacement
from .track_dataset import driven_units as driven_units
from .track_dataset import label_track as label_track
from .track_dataset import write_track_table as write_track_table
