JOINTS = [figure for figure in studies.joints() if "@" not in figure]


rule report:
    input:
        problem=ancient("experiments/{name}/problem.yaml"),
        datasets=rule_inputs.shown,
        comparisons=recordings.comparisons,
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
    wildcard_constraints:
        # figures of several studies have no problem of their own
        name=rule_inputs.none_of(["fig1", *JOINTS]),
    threads: 1
    params:
        study=rule_inputs.options,
        datasets=rule_inputs.shown_options,
        folder=subpath(output.page, parent=True),
        problem=rule_inputs.section("report"),
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
        datasets=rule_inputs.members,
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
        name=rule_inputs.any_of(JOINTS),
    threads: 1
    params:
        preset=lambda wildcards: wildcards.preset.replace("@", "--preset "),
        figure=rule_inputs.figure_hash,
        folder=subpath(output.page, parent=True),
        problem=rule_inputs.member_hashes,
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
        datasets=rule_inputs.members,
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
        # with the preset that asks for several: others of the study ask for one
        name=rule_inputs.any_of(
            (
                f"{study.name}(?=@{study.preset}/)"
                if study.preset
                else f"{study.name}(?=/)"
            )
            for study, designs in studies.families().items()
            if designs
        ),
        preset=r"(@[A-Za-z_]\w*)?",
    threads: 1
    params:
        study=rule_inputs.options,
        folder=subpath(output.page, parent=True),
        problem=rule_inputs.member_hashes,
        source=source_hash(REPORTS["several-designs"].module),
    message:
        "Drawing figure and page of {wildcards.name}{wildcards.preset}"
    shell:
        "python -m reports several-designs {params.study} --results results"
        " --out-dir {params.folder} --log {log}"


ruleorder: family_report > report
