rule simulate:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        design="results/{name}{preset}/design.nc",
    output:
        "results/{name}{preset}/response.nc",
    log:
        "results/{name}{preset}/logs/simulate.log",
    threads: 1
    params:
        study=options,
        problem=section("simulate"),
        source=source_hash("pipeline.simulate"),
    message:
        "Simulating the altered and the cloaked structure of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m pipeline.simulate {params.study} --design {input.design}"
        " --out {output} --log {log}"
