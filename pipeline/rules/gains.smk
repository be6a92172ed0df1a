rule gains:
    input:
        unpack(robust_designs),
    output:
        "results/{name}/gains.csv",
    log:
        "results/{name}/logs/gains.log",
    threads: 1
    params:
        designs=lambda wildcards, input: [
            f"{name}={path}" for name, path in input.items()
        ],
        source=source_hash("pipeline.gains"),
    message:
        "Evaluating what the robust presets of {wildcards.name} gain"
    shell:
        "python -m pipeline.gains --problem experiments/{wildcards.name}/problem.yaml"
        " --designs {params.designs} --out {output} --log {log}"
