rule spectrum:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        design="results/{name}{preset}/design.nc",
    output:
        "results/{name}{preset}/spectrum.nc",
    log:
        "results/{name}{preset}/logs/spectrum.log",
    threads: 1
    params:
        study=rule_inputs.options,
        problem=rule_inputs.section("spectrum"),
        source=source_hash("pipeline.stages.spectrum"),
    message:
        "Analysing small vibrations of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m pipeline spectrum {params.study} --design {input.design}"
        " --out {output} --log {log}"


rule spectrum_page:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        spectrum="results/{name}{preset}/spectrum.nc",
    output:
        multiext("results/{name}{preset}/spectrum/spectrum", ".pdf", ".svg", ".png"),
        expand(
            "results/{{name}}{{preset}}/spectrum/{table}.csv",
            table=["transmission", "modes", "bands"],
        ),
        page="results/{name}{preset}/spectrum/index.html",
    log:
        "results/{name}{preset}/logs/spectrum_page.log",
    threads: 1
    params:
        study=rule_inputs.options,
        folder=subpath(output.page, parent=True),
        problem=rule_inputs.section("report"),
        source=source_hash(REPORTS["spectrum"].module),
    message:
        "Drawing modes, transmission and waves of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m reports spectrum {params.study} --spectrum {input.spectrum}"
        " --out-dir {params.folder} --log {log}"
