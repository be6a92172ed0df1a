rule report:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        design="results/{name}{preset}/design.nc",
        response="results/{name}{preset}/response.nc",
        sweep="results/{name}{preset}/sweep.nc",
    output:
        multiext(
            "results/{name}{preset}/report/{name}",
            ".pdf",
            ".svg",
            ".png",
        ),
        page="results/{name}{preset}/report/index.html",
        facts="results/{name}{preset}/report/facts.json",
        tables=expand(
            "results/{{name}}{{preset}}/report/{table}.csv",
            table=["design", "facts", "loss_history", "robustness", "top_edge"],
        ),
    log:
        "results/{name}{preset}/logs/report.log",
    threads: 1
    params:
        study=options,
        folder=subpath(output.page, parent=True),
        problem=section("report"),
        source=source_hash("reports.build"),
    message:
        "Drawing figure and page of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m reports.build {params.study} --design {input.design}"
        " --response {input.response} --sweep {input.sweep}"
        " --out-dir {params.folder} --log {log}"
