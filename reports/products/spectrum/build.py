"""Draws a spectrum: the figure (PDF, SVG, PNG), its curves as CSV, and one page.

The same dataset gives the same bytes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from pipeline import datasets, problem
from pipeline.runtime import cli
from reports.base import Table, drawn
from reports.page import figure_page
from reports.products.spectrum import figure
from reports.study import study_results

if TYPE_CHECKING:
    import xarray as xr

    from reports.base import Table

_CAPTION = (
    "(a) Lowest modes, exaggerated and coloured by their motion; frequencies without damping."
    " (b) Steady motion under a small harmonic motion of the driven units, with damping; the mean"
    " over the load cases where there are several. (c) Waves round the triangle of the Brillouin"
    " zone, without damping, about the lattice at rest and compressed along x with the stress"
    " across relieved."
)


def _work(args: argparse.Namespace) -> None:

    asked = problem.load(args.problem, args.preset)
    data = datasets.read(args.spectrum, "spectrum")
    study_results.check_problem(asked, "spectrum", data, args.spectrum)
    made = figure_page.FigurePage(
        name="spectrum",
        title=asked.title or args.problem.resolve().parent.name,
        subject="small vibrations",
        lead="Small vibrations of the structures about their equilibria, and waves in the unit"
        " cell of the lattice.",
        caption=_CAPTION,
        figure=lambda: figure.draw_spectrum(data, asked),
        tables=[_transmission(data), _modes(data), _bands(data)],
        sources=data.attrs,
        datasets=["../spectrum.nc"],
    )
    figure_page.publish_figure_page(made, args.out_dir)


def _transmission(data: xr.Dataset) -> Table:
    text = "Motion of the region of interest per motion of the drive (rms)"
    return _table("transmission", text, data["transmission"])


def _modes(data: xr.Dataset) -> Table:
    return _table("modes", "Eigenfrequencies (Hz), undamped", data["frequency"])


def _bands(data: xr.Dataset) -> Table:
    return _table("bands", "Frequencies of waves in the unit cell (Hz)", data["band_frequency"])


def _table(name: str, text: str, values: xr.DataArray) -> Table:

    frame = values.rename("value").to_dataframe().reset_index()
    kept = [*values.dims, "value"]
    return Table(f"{name}.csv", text, {str(column): frame[column].tolist() for column in kept})


def main(argv: Sequence[str] | None = None) -> int:
    """Draw the spectrum; returns the exit code."""
    parser = cli.parser("reports.products.spectrum.build", str(__doc__))
    drawn(parser, "spectrum")
    return cli.run(_work, parser, argv)


if __name__ == "__main__":
    sys.exit(main())
