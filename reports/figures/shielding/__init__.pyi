from . import facts as facts
from . import figure as figure
from .facts import MONITORED as MONITORED
from .facts import monitored as monitored
from .facts import monitored_recordings as monitored_recordings
from .sweep_map import MAPPED as MAPPED
