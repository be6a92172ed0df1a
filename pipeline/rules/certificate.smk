# Losses of a design under loads that it was not designed for, beside those of the study's own design.
rule certify:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        design="results/{name}{preset}/design.nc",
        other=rule_inputs.own_design,
    output:
        "results/{name}{preset}/certificate.nc",
    log:
        "results/{name}{preset}/logs/certificate.log",
    threads: 2
    params:
        study=rule_inputs.options,
        other=lambda wildcards, input: [f"--other {path}" for path in input.other],
        problem=rule_inputs.section("certify"),
        source=source_hash("pipeline.stages.certify"),
    message:
        "Trying loads on {wildcards.name}{wildcards.preset}"
    shell:
        "python -m pipeline certify {params.study} --design {input.design} {params.other}"
        " --threads {threads} --out {output} --log {log}"


rule simulate_worst:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        design="results/{name}{preset}/design.nc",
        certificate="results/{name}{preset}/certificate.nc",
    output:
        "results/{name}{preset}/worst_response.nc",
    log:
        "results/{name}{preset}/logs/worst_response.log",
    threads: 1
    params:
        study=rule_inputs.options,
        problem=rule_inputs.section("simulate"),
        source=source_hash("pipeline.stages.simulate"),
    message:
        "Simulating {wildcards.name}{wildcards.preset} under its worst load"
    shell:
        "python -m pipeline simulate {params.study} --design {input.design}"
        " --certificate {input.certificate} --out {output} --log {log}"


rule certificate_page:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        design="results/{name}{preset}/design.nc",
        certificate="results/{name}{preset}/certificate.nc",
        response="results/{name}{preset}/worst_response.nc",
    output:
        multiext(
            "results/{name}{preset}/certificate/certificate",
            ".pdf",
            ".svg",
            ".png",
            ".csv",
        ),
        expand(
            "results/{{name}}{{preset}}/certificate/{table}.csv",
            table=["searches", "worst_load", "facts"],
        ),
        facts="results/{name}{preset}/certificate/facts.json",
        page="results/{name}{preset}/certificate/index.html",
    log:
        "results/{name}{preset}/logs/certificate_page.log",
    threads: 1
    params:
        study=rule_inputs.options,
        folder=subpath(output.page, parent=True),
        problem=rule_inputs.section("report"),
        source=source_hash(REPORTS["certificate"].module),
    message:
        "Drawing the loads tried on {wildcards.name}{wildcards.preset}"
    shell:
        "python -m reports certificate {params.study} --design {input.design}"
        " --certificate {input.certificate} --response {input.response} --out-dir {params.folder} --log {log}"


rule any_load:
    input:
        "results/fig2@unbiased/certificate/index.html",
