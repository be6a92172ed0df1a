"""Makes the page of the measured specimens beside their prediction, and of real pictures."""

import argparse
import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr

from pipeline import datasets
from pipeline.calibration.inputs import UNITS, KnownPictures
from pipeline.problem.fields import SIM_UNITS
from reports.base import Table
from reports.page import PageTable, Report, publish
from reports.products.validation import pictures
from reports.products.validation.figures import draw_cycles, draw_samples
from sim.core import Floats


def report(args: argparse.Namespace) -> None:
    """Makes the report that a command line asks for."""
    samples = datasets.read(args.samples, "population")
    cycles = datasets.read(args.cycles, "load_cycles")
    seen = datasets.read(args.pictures, "pictures")
    asked = json.loads(samples.attrs["population"])
    shown = KnownPictures.model_validate_json(seen.attrs["pictures"], context=SIM_UNITS)
    figures = {
        "prediction": lambda: draw_samples(samples),
        "cycles": lambda: draw_cycles(cycles),
        "pictures": lambda: pictures.draw_pictures(seen, shown, args.folder),
    }
    values = {
        "sources": [
            asked["source"],
            json.loads(cycles.attrs["load_cycles"])["source"],
            shown.rigid_parts.source.model_dump(),
            shown.specimen.source.model_dump(),
        ],
        "pictures": pictures.picture_facts(seen, shown),
        "headline": list(_headline(samples)),
        "shown": {
            "errors": _errors(samples),
            "constants": _constants(samples),
            "scales": _scales(samples),
            "left_out": _left_out(samples),
            "mechanisms": _mechanisms(samples),
            "cycles": _cycles(cycles),
            "pictures": pictures.error_table(seen),
        },
        "priors": asked["priors"],
        "signed": _signed(samples),
        "held": list(_held(samples)),
        "inside": bool(samples["inside"].item()),
        "correlation": [
            f"{value:+.2f}" for value in samples["correlation"].values[np.triu_indices(3, 1)]
        ],
        "emulator": f"{100 * samples['emulator_error'].values.max():.2g} %",
        "emulator_predicted": f"{100 * samples['emulator_error_predicted'].item():.2g} %",
        "r_hat": f"{samples['r_hat'].item():.3f}",
        "diverging": f"{100 * samples['diverging'].item():.2g} %",
        "provenance": sorted(
            (f"{name}: {key}", str(value))
            for name, made in (
                ("hinges.nc", samples),
                ("morpher.nc", cycles),
                ("pictures.nc", seen),
            )
            for key, value in made.attrs.items()
            if key not in ("population", "load_cycles", "pictures")
        ),
    }
    publish(Report(figures, "validation.html.j2", values, _tables(samples)), args.out_dir)


def relative_error(made: xr.Dataset, name: str) -> Floats:
    """Computes predicted less measured force (n,) over the largest measured one."""
    measured = made["measured"].values
    return np.asarray((made[name].values - measured) / measured.max())


def _headline(made: xr.Dataset) -> Iterator[Mapping[str, str]]:
    inside = "inside" if made["inside"].item() else "outside"
    width = made["high"].values / made["median"].values - 1
    covered = made["covered"].values
    yield {"value": inside, "what": "the measured curve lies in the band of a new sample, 95 %"}
    yield {"value": _rms(made, "median"), "what": "error of the median, rms of the largest force"}
    yield {"value": _rms(made, "simulated"), "what": "error of the authors’ simulation"}
    yield {
        "value": f"+{100 * width.mean():.0f} %",
        "what": "upper end of the band, over the median",
    }
    yield {
        "value": f"{100 * covered.mean():.1f} %",
        "what": f"of new curves inside, on {len(covered)} simulated sets of samples",
    }
    yield {
        "value": f"{made['width_to_student'].item():.2f}",
        "what": "width over that of Student’s interval of the samples"
        f" ({np.median(made['relative_width']):.2f} on the simulated sets)",
    }


def _rms(made: xr.Dataset, name: str) -> str:
    return f"{100 * np.sqrt((relative_error(made, name) ** 2).mean()):.1f} %"


def _signed(made: xr.Dataset) -> str:
    """Tells whether the residual has one sign."""
    error = relative_error(made, "median")
    if (error < 0).all():
        return "below the measured force everywhere"
    return "above the measured force everywhere" if (error > 0).all() else "of both signs"


def _errors(made: xr.Dataset) -> PageTable:
    rows = []
    for name, what in (
        ("median", "this fit, of the small specimens alone (median)"),
        ("doubled_median", "the same with priors twice as wide"),
        ("simulated", "the authors: 120 N/mm, 1.19 N/mm, 1.50 N mm/rad"),
    ):
        error = relative_error(made, name)
        at = [np.interp(x, made["displacement"], 100 * error) for x in (0.5, 1, 2, 3, 4)]
        band = {"median": ("low", "high"), "doubled_median": ("doubled_low", "doubled_high")}
        ends = [made[end].values[-1] for end in band.get(name, ())]
        told = f"{ends[0]:.1f} to {ends[1]:.1f} N" if ends else "none"
        rows.append([what, _rms(made, name), *(f"{value:+.1f} %" for value in at), told])
    heads = ["Prediction", "rms", *(f"at {x} mm" for x in (0.5, 1, 2, 3, 4)), "Band at the end"]
    return PageTable(heads, rows)


def _constants(made: xr.Dataset) -> PageTable:
    rows = []
    for k, name in enumerate(made["constant"].values.tolist()):
        mean, spread = made["mean"].values[:, k], 100 * made["spread"].values[:, k]
        own = made["of_sample"].values[1, :, k]
        rows.append(
            [
                f"{name.replace('_', ' ')}, {UNITS[name]}",
                f"{mean[1]:.3g} ({mean[0]:.3g} to {mean[2]:.3g})",
                f"{spread[1]:.0f} % ({spread[0]:.0f} to {spread[2]:.0f})",
                *(f"{value:.3g}" for value in own),
            ]
        )
    heads = ["Constant", "Mean (95 %)", "Spread (95 %)", *made["sample"].values.tolist()]
    return PageTable(heads, rows)


def _scales(made: xr.Dataset) -> PageTable:
    def words(values: Floats) -> str:
        low, middle, high = 100 * values
        return f"{middle:.1f} % ({low:.1f} to {high:.1f})"

    tests = made["test"].values.tolist()
    rows = [
        [label, *(words(made[name].values[:, k]) for k in range(len(tests)))]
        for name, label in (("mounting", "mounting"), ("reading", "reading"))
    ]
    rows.append(["model’s discrepancy", *[words(made["discrepancy"].values)] * len(tests)])
    return PageTable(["Error, relative to the force", *tests], rows)


def _left_out(made: xr.Dataset) -> PageTable:
    rows = [
        [
            without,
            curve.replace("_", " "),
            "in" if inside else "out",
            f"{100 * np.expm1(deviation):+.1f} %",
            f"±{100 * np.expm1(half):.0f} %",
        ]
        for without, curve, inside, deviation, half in zip(
            made["without"].values.tolist(),
            made["left_out_curve"].values.tolist(),
            made["left_out_inside"].values.tolist(),
            made["left_out_deviation"].values.tolist(),
            made["left_out_half_width"].values.tolist(),
            strict=True,
        )
    ]
    return PageTable(["Left out", "Curve", "Band", "Measured over median", "Half width"], rows)


def _held(made: xr.Dataset) -> Iterator[str]:
    """Counts curves inside by what was left out, and tells where all lie on one side."""
    without = made["without"].values.astype(str)
    for left in dict.fromkeys(without):
        mine = without == left
        inside = int(made["left_out_inside"].values[mine].sum())
        sides = np.sign(made["left_out_deviation"].values[mine])
        side = {3: "all above", -3: "all below"}.get(int(3 * sides.mean()), "on both sides of")
        yield f"without {left} {inside} of {mine.sum()} inside, {side} the median"


def _mechanisms(made: xr.Dataset) -> PageTable:
    columns = ("mechanism", "size", "explained", "explained_alone", "wanted", "change")
    rows = [
        [
            name,
            size,
            f"{100 * np.mean(change):+.2f} %",
            f"{100 * part:+.0f} %",
            f"{100 * alone:+.0f} %",
            f"{factor:.2g} ×",
        ]
        for name, size, part, alone, factor, change in zip(
            *(made[column].values.tolist() for column in columns), strict=True
        )
    ]
    heads = ["Physics left out", "Size", "Changes the prediction", "Explains of the residual"]
    return PageTable([*heads, "If in this test alone", "Size that explains most"], rows)


def _cycles(made: xr.Dataset) -> PageTable:
    rows = []
    for k, title in enumerate(made["title"].values.tolist()):
        areas = made["loop_area"].values[made["record_of_loop"].values == k]
        snaps = [
            f"{start:.2f} mm, {peak:.2f} N to {end:.2f} mm, {rest:.2f} N"
            for record, start, peak, end, rest in zip(
                *(
                    made[name].values
                    for name in (
                        "record_of_snap",
                        "snap_start",
                        "snap_peak",
                        "snap_end",
                        "snap_rest",
                    )
                ),
                strict=True,
            )
            if record == k
        ]
        misfit = made["misfit"].values[k]
        told = "not simulated" if np.isnan(misfit) else f"{misfit:.2f} N"
        loops = f"{areas[0]:.1f} first, {areas[1:].mean():.1f} later"
        rows.append([title, "; ".join(snaps) or "none", loops, told])
    return PageTable(["Test", "Snaps", "Loop areas, N mm", "Misfit of equilibria, rms"], rows)


def _tables(made: xr.Dataset) -> list[Table]:
    def columns(*names: str) -> dict[str, Any]:
        return {name: made[name].values for name in names}

    told = ("displacement", "measured", "simulated", "median", "low", "high")
    left = ("without", "left_out_curve", "left_out_inside", "left_out_half_width")
    return [
        Table("prediction.csv", "Prediction beside the measurement, mm and N", columns(*told)),
        Table("left_out.csv", "Curves left out of the fit", columns(*left)),
        Table("coverage.csv", "Simulated sets of samples", columns("covered", "relative_width")),
    ]
