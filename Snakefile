# From a problem file to a figure. `snakemake fig2` builds experiments/fig2 into results/fig2/,
# `snakemake all` every figure of the paper and results/index.html, `snakemake index` that page alone,
# `snakemake fig2@edge3` (or fig2_edge3) the same study with a preset. A figure.yaml in place of a
# problem.yaml shows several studies on one page. See profiles/default.
import sys

from snakemake.utils import min_version

from pipeline.workflow.calibration_inputs import (
    calibrations,
    description,
    measurements,
    problems_of,
)
from pipeline.workflow.recordings import (
    compared,
    comparisons,
    filmed,
    recording_pages,
    tracked,
)
from pipeline.runtime.source_closure import source_hash
from pipeline.workflow.studies import Study, families, figures, joints, present, targets
from reports.catalogue import REPORTS
from reports.paper_figures import paper_figures, paper_movies
from pipeline.workflow.rule_inputs import (
    any_of,
    check_problems,
    check_room,
    chunks,
    comparisons_of,
)
from pipeline.workflow.rule_inputs import (
    copies,
    datasets_of,
    designs,
    hashes_of,
    member_hashes,
)
from pipeline.workflow.rule_inputs import (
    members,
    options,
    packages,
    prepare_jobs,
    product_pages,
)
from pipeline.workflow.rule_inputs import (
    robust_designs,
    section,
    shown,
    shown_options,
    start_design,
)

min_version("9.20")


if workflow.is_main_process:
    check_problems(sys.argv[1:])
prepare_jobs()


include: "pipeline/rules/targets.smk"
include: "pipeline/rules/common.smk"
include: "pipeline/rules/design.smk"
include: "pipeline/rules/simulate.smk"
include: "pipeline/rules/sweep.smk"
include: "pipeline/rules/robustness.smk"
include: "pipeline/rules/spectrum.smk"
include: "pipeline/rules/gains.smk"
include: "pipeline/rules/fabrication.smk"
include: "pipeline/rules/tracking.smk"
include: "pipeline/rules/calibrate.smk"
include: "pipeline/rules/compare.smk"
include: "pipeline/rules/report.smk"
include: "pipeline/rules/framework.smk"
include: "pipeline/rules/movies.smk"
include: "pipeline/rules/stress.smk"
include: "pipeline/rules/index.smk"
include: "pipeline/rules/benchmark.smk"
