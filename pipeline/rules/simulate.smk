rule simulate:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        design="results/{name}{preset}/{law}design.nc",
    output:
        "results/{name}{preset}/{law}response.nc",
    log:
        "results/{name}{preset}/logs/{law}simulate.log",
    threads: 1
    resources:
        mem_mb=4000,
        runtime=60,
    params:
        study=rule_inputs.options,
        law=lambda wildcards: "--geometric" if wildcards.law else "",
        problem=rule_inputs.section("simulate"),
        source=source_hash("pipeline.stages.simulate"),
    message:
        "Simulating the altered and the cloaked structure of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m pipeline simulate {params.study} {params.law} --design {input.design}"
        " --out {output} --log {log}"


# With the shims bent as the slots are drawn.
rule as_built:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        design="results/{name}{preset}/design.nc",
    output:
        "results/{name}{preset}/built.nc",
    log:
        "results/{name}{preset}/logs/built.log",
    threads: 1
    resources:
        mem_mb=4000,
        runtime=60,
    params:
        study=rule_inputs.options,
        problem=rule_inputs.section("as_built"),
        source=source_hash("pipeline.stages.as_built"),
    message:
        "Simulating the structures of {wildcards.name}{wildcards.preset} as built"
    shell:
        "python -m pipeline as_built {params.study} --design {input.design}"
        " --out {output} --log {log}"
