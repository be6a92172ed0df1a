"""Names several designs of one problem: `designs:` lists the values of one parameter.

Each is named by its number, from one, after the preset if there is one: `2`, `quick.2`.
"""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from pipeline.problem.sections.sweep import Values
from pipeline.problem.sections.sweep_cases import apply_setting

SHARE = "objective.loads.nominal"
"""The parameter over which designs are a front: the share of the drive's own loads."""
Designs = Annotated[dict[str, Values], Field(min_length=1, max_length=1)]


def split_name(name: str | None) -> tuple[str | None, int | None]:
    """Splits "quick.2", "quick" or "2" into preset and number of the design."""
    preset, _, number = (name or "").rpartition(".")
    if number.isdigit():
        return preset or None, int(number)
    return name, None


def design_name(preset: str, number: int) -> str:
    """Names a design of a preset, or of none ("")."""
    return f"{preset}.{number}" if preset else str(number)


def design_count(data: Mapping[str, Any]) -> int:
    """Counts the designs that a problem file asks for; 0 if it asks for just one."""
    designs = data.get("designs")
    values = next(iter(designs.values()), None) if isinstance(designs, Mapping) else None
    return len(values) if isinstance(values, list) else 0


def select_design(data: Mapping[str, Any], number: int) -> dict[str, Any]:
    """Selects the content of a problem file for one of its designs.

    Raises:
        LookupError: there is no design of that number.
    """
    if not 1 <= number <= design_count(data):
        raise LookupError(f"there is no design number {number}")
    ((key, values),) = data["designs"].items()
    alone = {name: value for name, value in data.items() if name != "designs"}
    return apply_setting(alone, {key: values[number - 1]})
