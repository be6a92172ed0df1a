# From a problem file to a figure. `snakemake fig2` builds experiments/fig2 into results/fig2/,
# `snakemake all` every figure of the paper and results/index.html, `snakemake index` that page alone,
# `snakemake fig2@edge3` (or fig2_edge3) the same study with a preset. A figure.yaml in place of a
# problem.yaml shows several studies on one page. See profiles/default.
import sys

from snakemake.utils import min_version

from pipeline.calibrated import calibrations, description, measurements
from pipeline.filmed import compared, recording_pages, tracked
from pipeline.sources import source_hash
from pipeline.workflow import (
    check_problems,
    check_room,
    chunks,
    copies,
    designs,
    figures,
)
from pipeline.workflow import joints, member_hashes, members, options, prepare_jobs
from pipeline.workflow import movies, packages, product_pages, section, shown
from pipeline.workflow import screened, screened_comparisons, screened_hashes
from pipeline.workflow import shown_options, targets

min_version("9.20")


if workflow.is_main_process:
    check_problems(sys.argv[1:])
prepare_jobs()

for target, built in targets().items():

    rule:
        name:
            target
        input:
            f"results/{built}/report/index.html",

    rule:
        name:
            f"{target}_fabrication"
        input:
            product_pages(built, "fabrication"),

    rule:
        name:
            f"{target}_spectrum"
        input:
            product_pages(built, "spectrum"),

    rule:
        name:
            f"{target}_recordings"
        input:
            recording_pages(built),


include: "pipeline/rules/common.smk"
include: "pipeline/rules/design.smk"
include: "pipeline/rules/simulate.smk"
include: "pipeline/rules/sweep.smk"
include: "pipeline/rules/robustness.smk"
include: "pipeline/rules/spectrum.smk"
include: "pipeline/rules/fabrication.smk"
include: "pipeline/rules/tracking.smk"
include: "pipeline/rules/calibrate.smk"
include: "pipeline/rules/compare.smk"
include: "pipeline/rules/report.smk"
include: "pipeline/rules/movies.smk"
include: "pipeline/rules/index.smk"
