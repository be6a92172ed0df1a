"""Draws a spectrum: the figure (PDF, SVG, PNG), its curves as CSV, and one page.

The same dataset gives the same bytes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline import cli
from pipeline.errors import UserError

if TYPE_CHECKING:
    import xarray as xr

    from reports.tables import Table


def _work(args: argparse.Namespace) -> None:
    from pipeline import datasets, problem
    from pipeline.whole import whole
    from reports import style, templating
    from reports.spectrum import figure

    asked = problem.load(args.problem, args.preset)
    data = datasets.read(args.spectrum, "spectrum")
    wanted, found = problem.section_hash(asked, "spectrum"), data.attrs["problem_hash"]
    if found != wanted:
        raise UserError(
            "the dataset was made from another problem (or another preset)",
            file=args.spectrum,
            key="problem_hash",
            value=found,
            remedy="run pipeline.spectrum again with this problem",
        )
    args.out_dir.mkdir(parents=True, exist_ok=True)
    with style.styled():
        drawn = style.save(figure.build(data, asked), args.out_dir / "spectrum")
    tables = [_transmission(data), _modes(data), _bands(data)]
    for table in tables:
        with whole(args.out_dir / table.name) as aside:
            aside.write_bytes(table.csv)
    svg = (args.out_dir / "spectrum.svg").read_text(encoding="utf-8")
    values = {
        "title": asked.title or args.problem.resolve().parent.name,
        "svg": templating.inlined(svg),
        "files": [path.name for path in drawn],
        "tables": tables,
        "sources": sorted((key, str(value)) for key, value in data.attrs.items()),
    }
    with whole(args.out_dir / "index.html") as aside:
        text = templating.rendered("spectrum.html.j2", values)
        aside.write_text(text, encoding="utf-8", newline="\n")


def _transmission(data: xr.Dataset) -> Table:
    text = "Motion of the region of interest per motion of the drive (rms)"
    return _table("transmission", text, data["transmission"])


def _modes(data: xr.Dataset) -> Table:
    return _table("modes", "Eigenfrequencies (Hz), undamped", data["frequency"])


def _bands(data: xr.Dataset) -> Table:
    return _table("bands", "Frequencies of waves in the unit cell (Hz)", data["band_frequency"])


def _table(name: str, text: str, values: xr.DataArray) -> Table:
    from reports.tables import Table

    frame = values.rename("value").to_dataframe().reset_index()
    kept = [*values.dims, "value"]
    return Table(f"{name}.csv", text, {str(column): frame[column].tolist() for column in kept})


def main(argv: Sequence[str] | None = None) -> int:
    """Draw the spectrum; returns the exit code."""
    parser = cli.parser("reports.spectrum.build", str(__doc__))
    parser.add_argument("--spectrum", type=Path, required=True, metavar="NC", help="the dataset")
    parser.add_argument("--out-dir", type=Path, required=True, metavar="DIR", help="for all files")
    return cli.run(_work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
