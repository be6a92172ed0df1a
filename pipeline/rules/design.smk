# Two methods, one thread each: they run side by side on two cores.
rule design:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        start=rule_inputs.start_design,
    output:
        "results/{name}{preset}/design_{method}.nc",
    log:
        "results/{name}{preset}/logs/design_{method}.log",
    threads: 1
    resources:
        mem_mb=4000,
        runtime=480,
    params:
        study=rule_inputs.options,
        start=lambda wildcards, input: [f"--start {path}" for path in input.start],
        problem=rule_inputs.section("design"),
        source=source_hash("pipeline.stages.design"),
    message:
        "Designing {wildcards.name}{wildcards.preset} by {wildcards.method}"
    shell:
        "python -m pipeline design {params.study} --method {wildcards.method} {params.start}"
        " --out {output} --log {log}"


rule select:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        designs=rule_inputs.designs,
    output:
        "results/{name}{preset}/design.nc",
    log:
        "results/{name}{preset}/logs/select.log",
    localrule: True
    threads: 1
    params:
        study=rule_inputs.options,
        problem=rule_inputs.section("select"),
        source=source_hash("pipeline.stages.select"),
    message:
        "Choosing the better design of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m pipeline select {params.study} --designs {input.designs}"
        " --out {output} --log {log}"


# A design by the angle law of contact, under contact on distance: kept, or optimised again.
rule redesign:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        design="results/{name}{preset}/design.nc",
        response="results/{name}{preset}/response.nc",
    output:
        "results/{name}{preset}/geometric_design.nc",
    log:
        "results/{name}{preset}/logs/geometric_design.log",
    threads: 1
    resources:
        mem_mb=4000,
        runtime=240,
    params:
        study=rule_inputs.options,
        problem=rule_inputs.section("redesign"),
        source=source_hash("pipeline.stages.redesign"),
    message:
        "Reconsidering {wildcards.name}{wildcards.preset} with contact on distance"
    shell:
        "python -m pipeline redesign {params.study} --design {input.design}"
        " --response {input.response} --out {output} --log {log}"
