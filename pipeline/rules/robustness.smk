# A few jobs of many copies each, for a laptop and for a cluster alike.
MOST_PARTS = config.get("scatter_chunks", 2)


rule monte_carlo:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        design="results/{name}{preset}/design.nc",
    output:
        temp("results/{name}{preset}/scatter_{chunk}.nc"),
    log:
        "results/{name}{preset}/logs/scatter_{chunk}.log",
    threads: 1
    resources:
        mem_mb=2000,
        runtime=240,
    params:
        study=rule_inputs.options,
        chunks=lambda wildcards: len(rule_inputs.copies(wildcards, MOST_PARTS)),
        problem=rule_inputs.section("monte_carlo"),
        source=source_hash("pipeline.stages.monte_carlo"),
    message:
        "Simulating imperfect copies of {wildcards.name}{wildcards.preset}, part {wildcards.chunk}"
    shell:
        "python -m pipeline monte_carlo run {params.study} --design {input.design}"
        " --chunk {wildcards.chunk} --chunks {params.chunks} --out {output} --log {log}"


rule monte_carlo_gather:
    input:
        lambda wildcards: rule_inputs.copies(wildcards, MOST_PARTS),
    output:
        "results/{name}{preset}/scatter.nc",
    log:
        "results/{name}{preset}/logs/scatter.log",
    localrule: True
    threads: 1
    params:
        problem=rule_inputs.section("monte_carlo"),
        source=source_hash("pipeline.stages.monte_carlo"),
    message:
        "Joining the imperfect copies of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m pipeline monte_carlo gather --parts {input} --out {output} --log {log}"


# Not what the design depends on: finer steps of load or time, the other contact law.
rule verify:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        design="results/{name}{preset}/design.nc",
    output:
        "results/{name}{preset}/verification.nc",
    log:
        "results/{name}{preset}/logs/verification.log",
    threads: 1
    params:
        study=rule_inputs.options,
        problem=rule_inputs.section("verify"),
        source=source_hash("pipeline.stages.verify"),
    message:
        "Checking steps and contact of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m pipeline verify {params.study} --design {input.design}"
        " --out {output} --log {log}"
