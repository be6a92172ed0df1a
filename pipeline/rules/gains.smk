rule robust_gains:
    input:
        unpack(rule_inputs.robust_designs),
    output:
        "results/{name}/gains.nc",
    log:
        "results/{name}/logs/gains.log",
    threads: 1
    params:
        designs=lambda wildcards, input: [
            f"{name}={path}" for name, path in input.items()
        ],
        titles=rule_inputs.robust_titles,
        source=source_hash("pipeline.stages.robust_gains"),
    message:
        "Evaluating what the robust presets of {wildcards.name} gain"
    shell:
        "python -m pipeline robust_gains --problem experiments/{wildcards.name}/problem.yaml"
        " --designs {params.designs} --out {output} --log {log}"


rule robust_gains_page:
    input:
        gains="results/{name}/gains.nc",
    output:
        multiext("results/{name}/gains/gains", ".pdf", ".svg", ".png", ".csv"),
        page="results/{name}/gains/index.html",
    log:
        "results/{name}/logs/gains_page.log",
    threads: 1
    params:
        folder=subpath(output.page, parent=True),
        problem=rule_inputs.section("report"),
        source=source_hash(REPORTS["robust-gains"].module),
    message:
        "Drawing what the robust presets of {wildcards.name} gain"
    shell:
        "python -m reports robust-gains --problem experiments/{wildcards.name}/problem.yaml"
        " --gains {input.gains} --out-dir {params.folder} --log {log}"
