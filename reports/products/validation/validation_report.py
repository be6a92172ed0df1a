"""Makes the page of the measured specimens beside their prediction, and of real pictures."""

import argparse
import json
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from scipy.special import stdtrit

from pipeline import datasets
from pipeline.calibration.inputs import UNITS, KnownPictures
from pipeline.datasets.tables import Kind
from pipeline.problem.fields import SIM_UNITS
from pipeline.runtime import UserError
from reports.base import Table
from reports.facts import headed_columns
from reports.page import PageTable, Report, publish
from reports.products.validation import pictures
from reports.products.validation.figures import LIMIT, draw_cycles, draw_samples
from sim.core import Floats

NOTABLE = 0.1
"""Part of the residual from which a mechanism is named."""
_COLUMNS = 5
"""Displacements at which errors are told."""


def report(args: argparse.Namespace) -> None:
    """Makes the report that a command line asks for, of the parts that it names.

    Raises:
        UserError: it names none, or pictures without their folder.
    """
    given: dict[Kind, Path | None] = {
        "population": args.samples,
        "load_cycles": args.cycles,
        "pictures": args.pictures,
    }
    made = {kind: datasets.read(path, kind) for kind, path in given.items() if path is not None}
    if not made:
        raise UserError("nothing to show", remedy="give --samples, --cycles or --pictures")
    asked = {kind: json.loads(each.attrs[kind]) for kind, each in made.items()}
    figures: dict[str, Callable[[], Figure]] = {}
    values: dict[str, Any] = dict.fromkeys(
        ("shown", "cycles", "pictures", "checks", "reversals")
    ) | {"headline": []}
    tables: list[Table] = []
    if (samples := made.get("population")) is not None:
        figures["prediction"] = lambda: draw_samples(samples)
        values |= _of_samples(samples, asked["population"])
        tables = _tables(samples)
    if (cycles := made.get("load_cycles")) is not None:
        figures["cycles"] = lambda: draw_cycles(cycles)
        simulated = bool(np.isfinite(cycles["misfit"]).any())
        values |= {"cycles": cycle_table(cycles), "simulated_cycles": simulated}
        values["averaged"] = averaged_cycles(cycles)
        values |= {"checks": _checks(cycles), "reversals": np.nansum(cycles["reversals"]) > 0}
        values["cycles_doc"] = asked["load_cycles"]["doc"]
    values["sources"] = [each["source"] for each in asked.values() if "source" in each]
    if (seen := made.get("pictures")) is not None:
        if args.folder is None:
            raise UserError("the pictures are wanted", remedy="give --folder, where their YAML is")
        shown = KnownPictures.model_validate_json(seen.attrs["pictures"], context=SIM_UNITS)
        figures["pictures"] = lambda: pictures.draw_pictures(seen, shown, args.folder)
        values |= {"pictures": pictures.picture_facts(seen, shown)}
        values["tracked"] = pictures.error_table(seen)
        values["sources"] += [asked["pictures"][k]["source"] for k in ("rigid_parts", "specimen")]
    values["synthetic"] = any(each.attrs["synthetic"] == "yes" for each in made.values())
    files = [path for path in given.values() if path is not None]
    values["files"] = [Path(os.path.relpath(path, args.out_dir)).as_posix() for path in files]
    values["provenance"] = sorted(
        (f"{path.name}: {key}", str(value))
        for path, each in zip(files, made.values(), strict=True)
        for key, value in each.attrs.items()
        if key not in given
    )
    publish(Report(figures, "validation.html.j2", values, tables), args.out_dir)


def _of_samples(made: xr.Dataset, asked: Mapping[str, Any]) -> dict[str, Any]:
    count = made.sizes["sample"]
    quantile = stdtrit(count - 1, 0.975) * np.sqrt(1 + 1 / count)
    return {
        "headline": list(_headline(made)),
        "shown": {
            "errors": prediction_errors(made),
            "constants": _constants(made),
            "scales": _scales(made),
            "left_out": _left_out(made),
            "mechanisms": _mechanisms(made),
        },
        "count": count,
        "student": f"{quantile:.2f}",
        "priors": asked["priors"],
        "signed": _signed(made),
        "held": list(_held(made)),
        "flat": list(_flat(made)),
        "explained": [
            f"{name} {100 * part:.0f} %"
            for name, part in zip(
                made["mechanism"].values.tolist(), made["explained"].values, strict=True
            )
            if part > NOTABLE
        ],
        "inside": bool(made["inside"].item()),
        "correlation": [
            f"{value:+.2f}" for value in made["correlation"].values[np.triu_indices(3, 1)]
        ],
        "emulator": f"{100 * made['emulator_error'].values.max():.2g} %",
        "emulator_predicted": f"{100 * made['emulator_error_predicted'].item():.2g} %",
        "beyond": f"{100 * made['emulator_beyond'].item():.3g} %",
        "beyond_predicted": f"{100 * made['emulator_beyond_predicted'].item():.3g} %",
        "r_hat": f"{made['r_hat'].item():.3f}",
        "diverging": f"{100 * made['diverging'].item():.2g} %",
    }


def is_simulated(made: xr.Dataset) -> bool:
    """Tells whether a curve that others simulated is beside the prediction."""
    return bool(np.isfinite(made["simulated"]).any())


def relative_error(made: xr.Dataset, name: str) -> Floats:
    """Computes predicted less measured force (n,) over the largest measured one."""
    measured = made["measured"].values
    return np.asarray((made[name].values - measured) / measured.max())


def _headline(made: xr.Dataset) -> Iterator[Mapping[str, str]]:
    inside = "inside" if made["inside"].item() else "outside"
    width = made["high"].values / made["median"].values - 1
    covered = made["covered"].values
    yield {"value": inside, "what": "the band of a new sample, 95 %, lies the measured curve"}
    yield {"value": _rms(made, "median"), "what": "error of the median, rms of the largest force"}
    if is_simulated(made):
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
    return f"{100 * np.sqrt(np.nanmean(relative_error(made, name) ** 2)):.1f} %"


def _signed(made: xr.Dataset) -> str:
    """Tells whether the residual has one sign."""
    error = relative_error(made, "median")
    if (error < 0).all():
        return "below the measured force everywhere"
    return "above the measured force everywhere" if (error > 0).all() else "of both signs"


def prediction_errors(made: xr.Dataset) -> PageTable:
    """Tabulates errors of the predictions at displacements from the first to the last measured."""
    displacement, rows = made["displacement"].values, []
    at = np.unique(np.linspace(0, len(displacement) - 1, _COLUMNS).round().astype(int))
    for name, what in (
        ("median", "this fit, of the small specimens alone (median)"),
        ("doubled_median", "the same with priors twice as wide"),
        ("simulated", "the authors’ simulation"),
    )[: 3 if is_simulated(made) else 2]:
        error = 100 * relative_error(made, name)[at]
        band = {"median": ("low", "high"), "doubled_median": ("doubled_low", "doubled_high")}
        ends = [made[end].values[-1] for end in band.get(name, ())]
        told = f"{ends[0]:.1f} to {ends[1]:.1f} N" if ends else "none"
        shown = ("none" if np.isnan(value) else f"{value:+.1f} %" for value in error)
        rows.append([what, _rms(made, name), *shown, told])
    heads = [f"at {x:.3g} mm" for x in displacement[at]]
    return PageTable(["Prediction", "rms", *heads, "Band at the end"], rows)


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
            curve.replace("_", " ", 1),
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


def _flat(made: xr.Dataset) -> Iterator[str]:
    """Names the constants that may be half or twice as large as far as the readings tell."""
    factor = np.log(made["factor"].values)
    for name, lost in zip(made["constant"].values.tolist(), made["profile"].values, strict=True):
        if min(np.interp(np.log([0.5, 2.0]), factor, lost)) < LIMIT:
            yield name.replace("_", " ")


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


def averaged_cycles(made: xr.Dataset) -> str:
    """Tells which cycles the drawn ways are means over."""
    kept = made["title"].values[made["first"].values > 0].tolist()
    if len(kept) == made.sizes["record"]:
        return "all cycles"
    more = f" (with it: {', '.join(kept)})" if kept else ""
    return f"the cycles without the first{more}"


def cycle_table(made: xr.Dataset) -> PageTable:
    """Tabulates snaps, loop areas and misfits of the equilibria by record."""
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
        misfit, *jumps = (made[name].values[k] for name in ("misfit", "jumps", "reversals"))
        told = "not simulated"
        if not np.isnan(misfit):
            told = f"{misfit:.2f} N; {jumps[0]:.0f} jumps, {jumps[1]:.0f} of them reversals"
        later = f", {areas[1:].mean():.1f} later" if len(areas) > 1 else ""
        loops = f"{areas[0]:.1f} first{later}"
        rows.append([title, "; ".join(snaps) or "none", loops, told])
    return PageTable(
        ["Test", "Snaps", "Loop areas, N mm", "Misfit of equilibria, rms; their jumps"], rows
    )


def _checks(made: xr.Dataset) -> PageTable | None:
    """Tabulates the slope of the energy beside that which others computed; None without any."""
    numbers = made["record_of_check"].values
    known, found, force, motion = (
        made[f"check_{name}"].values for name in ("equilibrium", "difference", "force", "motion")
    )
    off = 100.0 * (found - known) / np.abs(known)
    rows = [
        [
            str(made["title"].values[numbers[k]]),
            f"{made['check_approach'].values[k]:g}",
            f"{known[k]:.2f}",
            f"{found[k]:.3f}",
            f"{off[k]:+.2f} %",
            f"{force[k]:.3f}",
            f"{motion[k]:.2f}",
        ]
        for k in range(len(numbers))
    ]
    heads = ["Test", "Approach, mm", "Known, N", "Here, N", "Apart", "Force here, N", "Authors, N"]
    return PageTable(heads, rows) if rows else None


def _tables(made: xr.Dataset) -> list[Table]:
    told = ("displacement", "measured", "simulated", "median", "low", "high")
    covered = ("covered", "relative_width")
    left = ("without", "left_out_curve", "left_out_inside", "left_out_half_width")
    return [
        Table("prediction.csv", "Prediction beside the measurement", headed_columns(made, *told)),
        Table("left_out.csv", "Curves left out of the fit", headed_columns(made, *left)),
        Table("coverage.csv", "Simulated sets of samples", headed_columns(made, *covered)),
    ]
