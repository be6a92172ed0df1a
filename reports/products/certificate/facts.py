"""States numbers of a certificate: losses over the family, under own loads and under the worst."""

from collections.abc import Iterator

import xarray as xr

from pipeline.posing import greatest_loss
from reports.facts import Fact, facts_of, grouped, measures
from reports.products.certificate.figure import CertifiedDesign, load_text, loss_unit

NEAR = 0.95
"""Of the greatest loss that was found: searches that end above it found the same worst."""
_told = facts_of(__file__)


def certificate_facts(found: CertifiedDesign) -> list[Fact]:
    """Returns all facts: of the family, of the worst load, and of the study's own design."""
    facts = [
        *grouped("Any load", _family(found.own)),
        *grouped("The worst load", _worst(found)),
        *grouped("The drive's own loads", _own(found.own)),
    ]
    if "study" in found.data["design"]:
        facts += grouped("The study's own design", _study(found.data.sel(design="study")))
    return facts


def _family(of: xr.Dataset) -> Iterator[Fact]:
    losses = of["loss"]
    mean, worst = float(losses.mean()), float(losses.max())
    lost = int(losses.isnull().sum())
    without = f"; {lost} could not be simulated and count in none of these numbers" if lost else ""
    yield _told("loads", of.sizes["load"], without=without)
    unit = loss_unit(of)
    yield _told("mean", mean, unit=unit)
    yield _told("share_95", float(losses.quantile(0.95)), unit=unit)
    yield _told("worst_random", worst, unit=unit)
    yield _told("worst_over_mean", worst / mean)


def _worst(found: CertifiedDesign) -> Iterator[Fact]:
    ends = found.own["found_loss"]
    yield _told("searches", ends.size)
    yield _told("worst_found", found.most, load=load_text(found), unit=loss_unit(found.own))
    yield _told("near", int((ends > NEAR * found.most).sum()))
    reduction = measures.reduction(found.worst.response["loss"].isel(case=0))
    yield _told("reduction", reduction)


def _own(of: xr.Dataset) -> Iterator[Fact]:
    unit = loss_unit(of)
    yield _told("nominal", float(of["nominal_loss"]), unit=unit)
    yield _told("nominal_worst", float(of["nominal_worst"]), unit=unit)


def _study(of: xr.Dataset) -> Iterator[Fact]:
    unit = loss_unit(of)
    yield _told("study_worst", greatest_loss(of), unit=unit)
    yield _told("study_nominal", float(of["nominal_loss"]), unit=unit)
