from . import jax_baseline as jax_baseline
from . import own_solvers as own_solvers
from . import scipy_statics as scipy_statics
from . import selection as selection
