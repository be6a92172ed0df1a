"""Describes tests of several samples, what is known of their constants, and a test to predict."""

from typing import Annotated, Self, get_args

from pydantic import Field, model_validator

from pipeline.calibration.inputs.description import (
    ForceColumns,
    Label,
    RecordOptions,
    Specimen,
    TestKind,
    check_reversed,
)
from pipeline.problem.fields import Count, File, Length, Positive, Samples, Section, fault
from pipeline.problem.sections import NumericConstants


class MeasurementSource(Section):
    """Credits those who measured.

    Attributes:
        by: their names.
        where: laboratory and machine.
        reference: the paper.
        address: of the paper.
        licence: of the numbers.
        reading: how the numbers came into the files.
    """

    by: str
    where: str
    reference: str = ""
    address: str = ""
    licence: str
    reading: str = ""


class SampleTest(Section):
    """Force over displacement of one sample, or the mean over several.

    Attributes:
        test: where the top row moves to; displacement and force count positive that way.
        samples: that the curve is of; of several it is the mean, each counting alike.
        file: a CSV with a heading, as seen from this file; or a track (.nc) with a load cell.
        columns: of the CSV.
        record: where the file is a machine's record: how it is cut.
    """

    test: TestKind
    samples: Annotated[tuple[Label, ...], Field(min_length=1)]
    file: File
    columns: ForceColumns = ForceColumns()
    record: RecordOptions | None = None

    @model_validator(mode="after")
    def _check_direction(self) -> Self:
        check_reversed(self.file, self.record)
        return self

    @property
    def name(self) -> str:
        """Names the curve by its test and samples, joined by a sign that no label holds."""
        return f"{self.test}_{'+'.join(self.samples)}"


class PredictedTest(SampleTest):
    """A test of another sample, held out of the fit.

    Attributes:
        lattice: its specimen.
        simulated: a curve that others simulated, to be shown on the same axes.
    """

    lattice: Specimen
    simulated: File | None = None


class Priors(Section):
    """Log-normal priors of constants, spreads and errors; `wide` is a factor, not a width.

    Attributes:
        constants: factor of one standard deviation on the mean constants, about `material`.
        spread: median of the samples' relative spread, of each constant.
        discrepancy: median of what the model misses, relative to the force.
        mounting: median of what a mounting changes, relative to the force.
        reading: median of the errors of single points, relative to the force.
        wide: factor of one standard deviation on those four.
    """

    constants: Annotated[float, Field(gt=1.0, le=10.0)] = 3.0
    spread: Positive = 0.1
    discrepancy: Positive = 0.02
    mounting: Positive = 0.03
    reading: Positive = 0.01
    wide: Annotated[float, Field(gt=1.0, le=10.0)] = 3.0

    @property
    def doubled(self) -> Self:
        """Doubles all standard deviations, which are of logarithms."""
        change = {"constants": self.constants**2, "wide": self.wide**2}
        return self.model_copy(update=change)


class Sampling(Section):
    """Effort of the sampler.

    Attributes:
        chains: of every fit, two or more, by which their agreement is told.
        warm_up: steps of each that are not kept.
        draws: that are.
        simulated_sets: sets of samples on which the band is tried, a chain each.
        simulated_draws: steps of each that are kept, after as many that are not.
    """

    chains: Samples = 2
    warm_up: Count = 300
    draws: Samples = 600
    simulated_sets: Count = 200
    simulated_draws: Samples = 250


class Population(Section):
    """Tests of several samples of one make, and a test of another sample that they predict.

    Attributes:
        title: one line about it.
        doc: more lines.
        source: who measured.
        spacing: of the lattice.
        material: centres of the priors of the three stiffnesses; the rest is known.
        lattice: the specimens of data.
        priors: of what is found.
        data: of all samples.
        predict: the test that is predicted.
        points: of a curve that the fit takes, spread evenly over its displacements.
        sampling: how long.
    """

    title: str = ""
    doc: str = ""
    source: MeasurementSource
    spacing: Length
    material: NumericConstants
    lattice: Specimen
    priors: Priors = Priors()
    data: Annotated[tuple[SampleTest, ...], Field(min_length=1)]
    predict: PredictedTest
    points: Count = 5
    sampling: Sampling = Sampling()

    @property
    def samples(self) -> tuple[str, ...]:
        """Names of all samples, sorted."""
        return tuple(sorted({name for each in self.data for name in each.samples}))

    @model_validator(mode="after")
    def _check_samples(self) -> Self:
        names = [each.name for each in self.data]
        if len(set(names)) < len(names):
            raise fault("two sets are of one test and sample", "join their files", "data")
        if len(self.samples) < 2:
            remedy = (
                "give tests of two samples or more; one alone is for python -m pipeline calibrate"
            )
            raise fault("one sample tells nothing of the others", remedy, "data")
        if taken := {"doubled", *get_args(TestKind)} & set(self.samples):
            remedy = "name it otherwise: fits without a sample or a kind of test go by their names"
            raise fault(f"a sample is named {min(taken)}", remedy, "data")
        if self.predict.test not in {each.test for each in self.data}:
            remedy = "give sets of that kind, or predict a test of another"
            raise fault(f"no set of data is of the kind {self.predict.test}", remedy, "predict")
        if seen := set(self.predict.samples) & set(self.samples):
            remedy = "predict a sample that no set of data is of"
            raise fault(f"the sample {min(seen)} is part of the fit", remedy, "predict")
        return self
