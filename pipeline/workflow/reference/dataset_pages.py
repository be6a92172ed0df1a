"""Writes the page on the datasets: every variable with its dimensions, its unit and its meaning."""

from collections.abc import Iterator

from pipeline.datasets.tables import SCHEMA_VERSION, SCHEMAS, Kind, Table, Variable
from pipeline.workflow.reference.markdown import head, table


def page() -> str:
    """Writes the page, in Markdown."""
    return head(__file__, version=SCHEMA_VERSION) + "".join(_kind(kind) for kind in SCHEMAS)


def _kind(kind: Kind) -> str:
    schema = SCHEMAS[kind]
    told = table(("variable", "dimensions", "unit", "what it holds"), _rows(schema.table))
    attributes = ", ".join(f"`{name}` ({meaning})" for name, meaning in schema.attributes.items())
    more = f"\nAttributes of its own: {attributes}.\n" if attributes else ""
    return f"\n## {kind}\n\n{schema.title}.\n\n{told}{more}"


def _rows(variables: Table) -> Iterator[tuple[str, str, str, str]]:
    for name, variable in variables.items():
        shown = f"*{name}*" if variable.coordinate else f"`{name}`"
        unit = " or ".join((variable.units, *variable.also))
        yield shown, ", ".join(variable.dims), unit, _meaning(variable)


def _meaning(variable: Variable) -> str:
    if variable.flags:
        flags = ", ".join(f"{value} {flag}" for flag, value in variable.flags.items())
        return f"{variable.long_name}: {flags}"
    if variable.values:
        return f"{variable.long_name}: {', '.join(variable.values)}"
    return variable.long_name
