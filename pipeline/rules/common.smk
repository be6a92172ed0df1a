container: "docker://python:3.13-bookworm"


wildcard_constraints:
    name=r"\w+",
    preset=r"(@\w+(\.\d+)?)?",
    method=r"\w+",
    recording=r"\w+",
    calibration=r"\w+",
    movie=r"S\d",
    suite=r"\w+",
    chunk=r"\d+",
    law=r"(geometric_)?",
    structure="intact|altered|cloaked",


onstart:
    made = [file for job in workflow.dag.needrun_jobs() for file in job.output]
    if made:  # and not only removed
        rule_inputs.check_writable("results")
    rule_inputs.hold_studies(made)
    if not workflow.non_local_exec:
        interrupts.end_jobs(spared=stage_server.start())
    first_look.show(
        f"{job.wildcards.name}{job.wildcards.preset}"
        for job in workflow.dag.needrun_jobs()
        if job.rule.name == "design"
    )


# What was built, and the caches of compiled solvers and plots.
rule clean:
    log:
        ".snakemake/clean.log",
    localrule: True
    shell:
        "rm -rf results .cache 2> {log}"
