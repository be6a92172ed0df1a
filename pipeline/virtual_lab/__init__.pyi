from . import ground_truth as ground_truth
from . import noise_planning as noise_planning
from .filming import of_case as of_case
from .filming import of_structure as of_structure
from .filming import prepared as prepared
from .imperfect_specimen import specimen as specimen
from .load_cell_log import log as log
from .video_writer import encode as encode
