from . import frame_rates as frame_rates
