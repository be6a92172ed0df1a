"""Constrained minimisation of expensive, differentiable losses: one interface, two methods."""

from sim.optimise.interface import minimise
from sim.optimise.journal import Journal, JournalInUseError
from sim.optimise.kkt import Stationarity, stationarity
from sim.optimise.mma import MmaOptions
from sim.optimise.problem import Evaluation, InfeasibleStartError, Result
from sim.optimise.sqp import SqpOptions

__all__ = [
    "Evaluation",
    "InfeasibleStartError",
    "Journal",
    "JournalInUseError",
    "MmaOptions",
    "Result",
    "SqpOptions",
    "Stationarity",
    "minimise",
    "stationarity",
]
