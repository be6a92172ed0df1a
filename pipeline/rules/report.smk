rule report:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        datasets=shown,
        comparisons=comparisons,
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
            table=["design", "facts", "loss_history"],
        ),
    log:
        "results/{name}{preset}/logs/report.log",
    threads: 1
    params:
        study=options,
        datasets=shown_options,
        folder=subpath(output.page, parent=True),
        problem=section("report"),
        source=source_hash(REPORTS["study"].module),
    message:
        "Drawing figure and page of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m reports study {params.study} {params.datasets}"
        " --comparisons {input.comparisons} --out-dir {params.folder} --log {log}"


# Several studies on one page.
rule joint_report:
    input:
        figure=ancient("experiments/{name}/figure.yaml"),
        datasets=members,
    output:
        multiext(
            "results/{name}{preset}/report/{name}",
            ".pdf",
            ".svg",
            ".png",
        ),
        page="results/{name}{preset}/report/index.html",
        facts="results/{name}{preset}/report/facts.json",
    log:
        "results/{name}{preset}/logs/report.log",
    wildcard_constraints:
        name=any_of(figure for figure in joints() if "@" not in figure),
    threads: 1
    params:
        preset=lambda wildcards: wildcards.preset.replace("@", "--preset "),
        folder=subpath(output.page, parent=True),
        problem=member_hashes,
        source=source_hash(REPORTS["several-studies"].module),
    message:
        "Drawing figure and page of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m reports several-studies --figure {input.figure} {params.preset}"
        " --results results --out-dir {params.folder} --log {log}"


# Several designs of one problem on one page.
rule family_report:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        datasets=members,
    output:
        multiext(
            "results/{name}{preset}/report/{name}",
            ".pdf",
            ".svg",
            ".png",
        ),
        page="results/{name}{preset}/report/index.html",
        facts="results/{name}{preset}/report/facts.json",
    log:
        "results/{name}{preset}/logs/report.log",
    wildcard_constraints:
        name=any_of(study.name for study, designs in families().items() if designs),
        preset=r"(@[A-Za-z_]\w*)?",
    threads: 1
    params:
        study=options,
        folder=subpath(output.page, parent=True),
        problem=member_hashes,
        source=source_hash(REPORTS["several-designs"].module),
    message:
        "Drawing figure and page of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m reports several-designs {params.study} --results results"
        " --out-dir {params.folder} --log {log}"


ruleorder: joint_report > family_report > report
