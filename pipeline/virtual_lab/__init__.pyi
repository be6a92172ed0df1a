from . import noise_planning as noise_planning
from .filmed_motion import load_cell_log as load_cell_log
from .filming import assemble_truth as assemble_truth
from .filming import prepare_film as prepare_film
from .filming import select_case as select_case
from .filming import select_structure as select_structure
from .imperfect_specimen import make_specimen as make_specimen
from .video_writer import encode_video as encode_video
