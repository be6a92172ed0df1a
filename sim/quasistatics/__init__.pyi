from . import newton as newton
from . import static_solver as static_solver
from .static_solver import StaticRecord as StaticRecord
from .static_solver import StaticSolver as StaticSolver
