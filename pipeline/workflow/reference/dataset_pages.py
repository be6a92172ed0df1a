"""Writes the page on the datasets: every variable with its dimensions, its unit and its meaning."""

from __future__ import annotations

from collections.abc import Iterator

from pipeline.datasets.tables import (
    SCHEMA_VERSION,
    SCHEMAS,
    Kind,
    Table,
    Variable,
)
from pipeline.workflow.reference.markdown import table

HEAD = f"""\
# Datasets

<!-- Made by `python -m pipeline reference` from the tables that every file is checked
against. -->

Every dataset is a netCDF-4 file that keeps the CF conventions, version 1.11, and that plain
`xarray.open_dataset`, ncview or Panoply open. Places are in the specimen's frame: origin at the
lattice point of unit (0, 0), x to the right, y up, rotations counter-clockwise; `unit` carries the
design's ids. A response at one case, `response.sel(structure="cloaked").isel(case=0)`, and a track
have the same dimensions and coordinates.

* `units` is spelled for UDUNITS; `1` stands for ids, names, ratios, counts and pixels. A variable
  whose components differ in unit has no `units`, which could not be true of all of them, but
  `component_units`: `mm (ux, uy), rad (theta)`.
* `time` is the time since the start of the drive or of a recording, in s, and no date. In a static
  study it stands for the load.
* NaN is a value that is absent: a void's units, padding, free degrees of freedom.
* Attributes tell where a file comes from: `problem` (as far as the stage depends on it) and its
  hash, `parents` (SHA-256 of what was read), `packages`, `git_commit`, `plan`. There are no dates:
  the same sources make the same bytes.
* `seal` is the SHA-256 of all other bytes of the file. What the workflow reads is checked against
  it: a file that was changed, cut or scrambled since it was written is refused. It tells damage,
  not malice; other programs need not know of it, and what they write has none.
* `schema_version` is {SCHEMA_VERSION}; older files are read as if they were of this version, or
  refused with what to do.

Names in *italics* are coordinates.
"""


def page() -> str:
    """Writes the page, in Markdown."""
    return HEAD + "".join(_kind(kind) for kind in SCHEMAS)


def _kind(kind: Kind) -> str:
    schema = SCHEMAS[kind]
    told = table(("variable", "dimensions", "unit", "what it holds"), _rows(schema.table))
    attributes = ", ".join(f"`{name}` ({meaning})" for name, meaning in schema.attributes.items())
    more = f"\nAttributes of its own: {attributes}.\n" if attributes else ""
    return f"\n## {kind}\n\n{schema.title}.\n\n{told}{more}"


def _rows(variables: Table) -> Iterator[tuple[str, str, str, str]]:
    for name, variable in variables.items():
        shown = f"*{name}*" if variable.coordinate else f"`{name}`"
        yield shown, ", ".join(variable.dims), _unit(variable), _meaning(variable)


def _unit(variable: Variable) -> str:
    return " or ".join((variable.units, *variable.also))


def _meaning(variable: Variable) -> str:
    if variable.flags:
        flags = ", ".join(f"{value} {flag}" for flag, value in variable.flags.items())
        return f"{variable.long_name}: {flags}"
    if variable.values:
        return f"{variable.long_name}: {', '.join(variable.values)}"
    return variable.long_name
