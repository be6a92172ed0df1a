# From a problem file to a figure. `snakemake fig2` builds experiments/fig2 into results/fig2/,
# `snakemake all` every figure of the paper and results/index.html, `snakemake index` that page alone,
# `snakemake fig2@edge3` (or fig2_edge3) the same study with a preset. A figure.yaml in place of a
# problem.yaml shows several studies on one page. See profiles/default.
import sys
from functools import partial

from snakemake.utils import min_version

from pipeline.runtime import source_hash, stage_server
from pipeline.workflow import (
    calibration_inputs,
    first_look,
    recordings,
    rule_inputs,
    studies,
)
from pipeline.workflow.runs import interrupts
from reports.catalogue import REPORTS
from reports.paper_figures import paper_figures, paper_movies

min_version("9.20")


if workflow.is_main_process:
    rule_inputs.check_problems(sys.argv[1:])
rule_inputs.prepare_jobs(workflow.is_main_process)


# Stands first: it is what snakemake makes where no target is named.
rule no_target:
    input:
        rule_inputs.no_target,


include: "pipeline/rules/targets.smk"
include: "pipeline/rules/common.smk"
include: "pipeline/rules/design.smk"
include: "pipeline/rules/simulate.smk"
include: "pipeline/rules/sweep.smk"
include: "pipeline/rules/robustness.smk"
include: "pipeline/rules/spectrum.smk"
include: "pipeline/rules/gains.smk"
include: "pipeline/rules/certificate.smk"
include: "pipeline/rules/front.smk"
include: "pipeline/rules/fabrication.smk"
include: "pipeline/rules/tracking.smk"
include: "pipeline/rules/calibrate.smk"
include: "pipeline/rules/validation.smk"
include: "pipeline/rules/compare.smk"
include: "pipeline/rules/report.smk"
include: "pipeline/rules/framework.smk"
include: "pipeline/rules/movies.smk"
include: "pipeline/rules/stress.smk"
include: "pipeline/rules/index.smk"
include: "pipeline/rules/benchmark.smk"
