# Several designs under the drive's own loads and under the worst of a family: what the one costs the other.
rule front:
    input:
        unpack(rule_inputs.front_designs),
    output:
        "results/{name}/front.nc",
    log:
        "results/{name}/logs/front.log",
    threads: 2
    params:
        designs=lambda wildcards, input: [
            f"{name}={path}" for name, path in input.items()
        ],
        source=source_hash("pipeline.stages.front"),
    message:
        "Searching the worst loads for the designs of {wildcards.name}"
    shell:
        "python -m pipeline front --problem experiments/{wildcards.name}/problem.yaml"
        " --designs {params.designs} --threads {threads} --out {output} --log {log}"


rule front_page:
    input:
        front="results/{name}/front.nc",
        certificates=rule_inputs.front_certificates,
    output:
        multiext("results/{name}/front/front", ".pdf", ".svg", ".png", ".csv"),
        page="results/{name}/front/index.html",
    log:
        "results/{name}/logs/front_page.log",
    threads: 1
    params:
        folder=subpath(output.page, parent=True),
        problem=rule_inputs.section("report"),
        source=source_hash(REPORTS["front"].module),
    message:
        "Drawing what it costs {wildcards.name} to hold against any load"
    shell:
        "python -m reports front --problem experiments/{wildcards.name}/problem.yaml"
        " --front {input.front} --certificates {input.certificates}"
        " --out-dir {params.folder} --log {log}"
