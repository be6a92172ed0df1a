# A few jobs of many cases each, for a laptop and for a cluster alike.
MOST_CHUNKS = config.get("sweep_chunks", 4)


rule sweep:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        design="results/{name}{preset}/design.nc",
    output:
        temp("results/{name}{preset}/sweep_{chunk}.nc"),
    log:
        "results/{name}{preset}/logs/sweep_{chunk}.log",
    threads: 1
    resources:
        mem_mb=2000,
        runtime=240,
    params:
        study=rule_inputs.options,
        chunks=lambda wildcards: len(rule_inputs.chunks(wildcards, MOST_CHUNKS)),
        problem=rule_inputs.section("sweep"),
        source=source_hash("pipeline.stages.sweep"),
    message:
        "Sweeping parameters of {wildcards.name}{wildcards.preset}, part {wildcards.chunk}"
    shell:
        "python -m pipeline sweep run {params.study} --design {input.design}"
        " --chunk {wildcards.chunk} --chunks {params.chunks} --out {output} --log {log}"


rule sweep_gather:
    input:
        lambda wildcards: rule_inputs.chunks(wildcards, MOST_CHUNKS),
    output:
        "results/{name}{preset}/sweep.nc",
    log:
        "results/{name}{preset}/logs/sweep.log",
    localrule: True
    threads: 1
    params:
        problem=rule_inputs.section("sweep"),
        source=source_hash("pipeline.stages.sweep"),
    message:
        "Joining the parts of the sweep of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m pipeline sweep gather --parts {input} --out {output} --log {log}"


# Over what measured specimens tell of the constants: a line of the report.
rule sweep_constants:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        design="results/{name}{preset}/design.nc",
        constants=rule_inputs.constants_file,
    output:
        "results/{name}{preset}/constants.nc",
    log:
        "results/{name}{preset}/logs/constants.log",
    threads: 1
    resources:
        mem_mb=2000,
        runtime=240,
    params:
        study=rule_inputs.options,
        problem=rule_inputs.constants_section,
        source=source_hash("pipeline.stages.sweep"),
    message:
        "Simulating measured constants of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m pipeline sweep constants {params.study} --design {input.design}"
        " --out {output} --log {log}"


rule sweep_page:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        sweep="results/{name}{preset}/sweep.nc",
    output:
        multiext("results/{name}{preset}/sweep/sweep", ".pdf", ".svg", ".png"),
        "results/{name}{preset}/sweep/cases.csv",
        "results/{name}{preset}/sweep/facts.csv",
        page="results/{name}{preset}/sweep/index.html",
    log:
        "results/{name}{preset}/logs/sweep_page.log",
    threads: 1
    params:
        study=rule_inputs.options,
        folder=subpath(output.page, parent=True),
        problem=rule_inputs.section("report"),
        source=source_hash(REPORTS["sweep"].module),
    message:
        "Drawing the sweep of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m reports sweep {params.study} --sweep {input.sweep}"
        " --out-dir {params.folder} --log {log}"
