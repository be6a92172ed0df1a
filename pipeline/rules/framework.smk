# Figure 1: the framework, drawn from what Figure 2 has computed.
rule fig1:
    input:
        problem=ancient("experiments/fig2/problem.yaml"),
        datasets=lambda wildcards: rule_inputs.datasets_of(studies.FRAMED),
        comparisons=lambda wildcards: rule_inputs.comparisons_of(studies.FRAMED),
    output:
        multiext("results/fig1/report/fig1", ".pdf", ".svg", ".png"),
        page="results/fig1/report/index.html",
    log:
        "results/fig1/logs/report.log",
    threads: 1
    params:
        folder=subpath(output.page, parent=True),
        problem=lambda wildcards: rule_inputs.hashes_of(studies.FRAMED),
        source=source_hash("reports.figures.framework.build"),
    message:
        "Drawing the framework"
    shell:
        "python -m reports.figures.framework.build --problem {input.problem} --results results"
        " --comparisons {input.comparisons} --out-dir {params.folder} --log {log}"


ruleorder: fig1 > report
