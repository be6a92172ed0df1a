# From a problem file to a figure. `snakemake fig2` builds experiments/fig2 into results/fig2/,
# `snakemake fig2@edge3` (or fig2_edge3) the same study with a preset. See profiles/default.
from snakemake.utils import min_version

from pipeline.sources import source_hash
from pipeline.workflow import designs, options, prepare_jobs, section, studies

min_version("9.20")


container: "docker://python:3.13-bookworm"


wildcard_constraints:
    name=r"\w+",
    preset=r"(@\w+)?",
    method=r"\w+",
    chunk=r"\d+",


prepare_jobs()

for study in studies():
    for target in study.targets:

        rule:
            name:
                target
            input:
                f"results/{study}/report/index.html",


include: "pipeline/rules/design.smk"
include: "pipeline/rules/simulate.smk"
include: "pipeline/rules/sweep.smk"
include: "pipeline/rules/report.smk"
