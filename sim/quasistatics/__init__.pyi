from . import newton as newton
from . import static_solver as static_solver
from .eigenvalue import eigenvalue_and_slopes as eigenvalue_and_slopes
from .eigenvalue import lowest_eigenpair as lowest_eigenpair
from .equilibrium_path import BRANCHING as BRANCHING
from .equilibrium_path import LIMIT_POINT as LIMIT_POINT
from .static_solver import StaticRecord as StaticRecord
from .static_solver import StaticSolver as StaticSolver
