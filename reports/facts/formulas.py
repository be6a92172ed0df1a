"""States what the loss of a problem is, in symbols."""

from pipeline.problem import Problem

_SAMPLES = "the time"


def loss_formula(problem: Problem) -> str:
    """Returns the formula of a response's loss, U = (u_x/s, u_y/s, θ) with the spacing s."""
    asked = problem.objective
    course = _SAMPLES if problem.horizon.steps is None else "the load steps"
    words = f"{_formula(problem, course)} over the region of interest"
    if asked.target == "intact" and asked.kind == "displacement":
        words += ", U₀ that of the intact structure"
        if asked.reaction is not None:
            words += "; of the motion alone, without the drive’s force"
    if len(problem.drive.case_weights) > 1:
        words += "; mean of the load cases"
    return words


def weighted_force(problem: Problem) -> str:
    """Tells what is minimised beside the loss of the motion; "" where nothing is."""
    weight = problem.objective.reaction
    return (
        "" if weight is None else f"; plus {weight:g} times the relative error of the drive’s force"
    )


def _formula(problem: Problem, course: str) -> str:
    asked = problem.objective
    if asked.kind == "strain_energy":
        return f"mean over {course} of the strain energy"
    if asked.target == "rest":
        return f"mean over {course} of ‖U‖²"
    if course == _SAMPLES:
        return "root of the mean over the time of ‖U − U₀‖², divided by max ‖U₀‖,"
    return "root of the sum over the load steps of ‖U − U₀‖², divided by ‖U₀‖ at full load,"
