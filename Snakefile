# From a problem file to a figure. `snakemake fig2` builds experiments/fig2 into results/fig2/,
# `snakemake fig2@edge3` (or fig2_edge3) the same study with a preset. See profiles/default.
import sys

from snakemake.utils import min_version

from pipeline.sources import source_hash
from pipeline.workflow import check_problems, check_room, chunks, copies, designs
from pipeline.workflow import (
    options,
    prepare_jobs,
    section,
    shown,
    shown_options,
    studies,
)

min_version("9.20")


if workflow.is_main_process:
    check_problems(sys.argv[1:])
prepare_jobs()

for study in studies():
    for target in study.targets:

        rule:
            name:
                target
            input:
                f"results/{study}/report/index.html",


include: "pipeline/rules/common.smk"
include: "pipeline/rules/design.smk"
include: "pipeline/rules/simulate.smk"
include: "pipeline/rules/sweep.smk"
include: "pipeline/rules/robustness.smk"
include: "pipeline/rules/report.smk"
