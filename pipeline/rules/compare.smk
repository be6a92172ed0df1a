# What was filmed beside the simulation of it, driven as the specimen was.
rule compare:
    input:
        unpack(recordings.compared),
        problem=ancient("experiments/{name}/problem.yaml"),
        design="results/{name}{preset}/design.nc",
        response="results/{name}{preset}/response.nc",
        track="results/{name}{preset}/recordings/{recording}/track.nc",
    output:
        "results/{name}{preset}/recordings/{recording}/comparison.nc",
    log:
        "results/{name}{preset}/logs/compare_{recording}.log",
    threads: 1
    params:
        study=rule_inputs.options,
        problem=rule_inputs.section("compare"),
        source=source_hash("pipeline.stages.compare"),
    message:
        "Comparing {wildcards.recording} of {wildcards.name}{wildcards.preset} with its simulation"
    shell:
        "python -m pipeline compare {params.study} --design {input.design}"
        " --response {input.response} --recording {input.recording} --track {input.track}"
        " --out {output} --log {log}"
