from . import jax_baseline as jax_baseline
from . import selection as selection
