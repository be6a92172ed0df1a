# One package for each structure that would be built; the stage puts a whole folder in its place.
rule fabricate:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        design="results/{name}{preset}/design.nc",
    output:
        "results/{name}{preset}/fabrication/{structure}/manifest.json",
    log:
        "results/{name}{preset}/logs/fabricate_{structure}.log",
    threads: 1
    params:
        study=rule_inputs.options,
        folder=subpath(output[0], parent=True),
        problem=rule_inputs.section("fabricate"),
        source=source_hash("pipeline.stages.fabricate"),
    message:
        "Drawing what is made of the {wildcards.structure} structure of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m pipeline fabricate {params.study} --design {input.design}"
        " --structure {wildcards.structure} --out-dir {params.folder} --log {log}"


rule fabrication_page:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        packages=rule_inputs.packages,
    output:
        "results/{name}{preset}/fabrication/index.html",
    log:
        "results/{name}{preset}/logs/fabrication_page.log",
    threads: 1
    params:
        study=rule_inputs.options,
        folders=lambda wildcards, input: [
            path.rpartition("/")[0] for path in input.packages
        ],
        problem=rule_inputs.section("fabricate"),
        source=source_hash(REPORTS["fabrication"].module),
    message:
        "Drawing the page of what is built of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m reports fabrication {params.study} --packages {params.folders}"
        " --out {output} --log {log}"
