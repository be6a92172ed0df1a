"""Describes sections that no design depends on: robustness and report."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from pipeline.problem.fields import (
    Coordinate,
    Count,
    Delay,
    File,
    Gap,
    Modulus,
    Positive,
    PositiveShare,
    Samples,
    Section,
    Share,
    fault,
)


class WorkshopTolerance(Section):
    """Imperfections that copies have all at once: those of a printer and its shims.

    Other copies have each of them alone, and others again a factor of each of the three stiffnesses
    that is common to all ligaments, which scatters as much.

    Attributes:
        geometry: largest shift of a vertex along x and y, either way and evenly spread.
        stiffness: standard deviation of each of every ligament's stiffnesses, as a share of it.
    """

    geometry: Gap = 0.1
    stiffness: Share = 0.1


class Robustness(Section):
    """Imperfect copies of the shipped design, each simulated.

    Attributes:
        samples: copies of each kind and size of imperfection.
        geometry: largest shifts of a vertex along x and y, either way and evenly spread, as shares
            of the spacing.
        stiffness: standard deviations of every ligament's stiffnesses, as shares of them.
        together: of shifts and stiffnesses in the same copies; none with null.
        seed: of the random numbers.
    """

    samples: Count = 200
    geometry: tuple[Share, ...] = (0.03, 0.05)
    stiffness: tuple[Share, ...] = (0.1,)
    together: WorkshopTolerance | None = WorkshopTolerance()
    seed: Annotated[int, Field(ge=0, strict=True)] = 0

    @model_validator(mode="after")
    def _asks_for_copies(self) -> Self:
        if not self.geometry and not self.stiffness and self.together is None:
            remedy = "give a size, or leave the section out (a preset: `robustness: null`)"
            raise fault("no copies are asked for", remedy, "together")
        return self


class MeasuredConstants(Section):
    """Constants of specimens as measured, over which the losses of a design are shown as well.

    Attributes:
        file: a CSV with columns axial_stiffness, shear_stiffness and bending_stiffness, each with
            its unit, a draw from what is known of new specimens a line.
        samples: draws that are simulated, spread evenly over the file.
    """

    file: File
    samples: Samples = 100


class Paper(Section):
    """Values of a publication on this study, to stand beside the numbers computed here.

    Attributes:
        figure: its figure.
        variant: which of its sets of values is run.
        strain: its label of the full load.
        values: the words that it uses for the facts of the report, by key.
    """

    figure: str
    variant: str = ""
    strain: Positive | None = None
    values: dict[str, str] = Field(default_factory=dict)


class ReportOptions(Section):
    """Choices of the report.

    Attributes:
        snapshots: driven displacements that it shows.
        instants: times of a motion in time that it shows.
        places: the units nearest to these are followed over time, at most three.
        shim_strain_limit: the strain up to which the foil of the shims counts as sound (polyester
            yields at about 5 %).
        unit_modulus: Young's modulus of the units, which count as rigid; the page and `check` warn
            of such as are soft against their ligaments. Their height is `fabrication.thickness`.
        as_built: whether it also tells what the structures do with their shims bent as the slots of
            `fabrication` are drawn.
        measured_constants: constants over which the losses are shown as well.
        paper: what a publication tells.
    """

    snapshots: tuple[Gap, ...] = ()
    instants: tuple[Delay, ...] = ()
    places: Annotated[tuple[tuple[Coordinate, Coordinate], ...], Field(max_length=3)] = ()
    shim_strain_limit: PositiveShare = 0.05
    unit_modulus: Modulus = 2000.0
    as_built: bool = False
    measured_constants: MeasuredConstants | None = None
    paper: Paper | None = None
