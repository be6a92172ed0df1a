from . import interrupts as interrupts
from . import run_watch as run_watch
from . import stale_jobs as stale_jobs
from . import study_lock as study_lock
from . import write_access as write_access
from .live_runs import SNAKEMAKE as SNAKEMAKE
from .live_runs import Run as Run
