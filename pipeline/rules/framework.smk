# Figure 1: the framework, drawn from what Figure 2 has computed.
FRAMED = [studies.Study(name) for name in paper_figures()["fig1"].studies]


rule fig1:
    input:
        problem=ancient("experiments/fig2/problem.yaml"),
        datasets=lambda wildcards: rule_inputs.datasets_of(FRAMED),
        comparisons=lambda wildcards: rule_inputs.comparisons_of(FRAMED),
    output:
        multiext("results/fig1/report/fig1", ".pdf", ".svg", ".png"),
        page="results/fig1/report/index.html",
    log:
        "results/fig1/logs/report.log",
    threads: 1
    params:
        folder=subpath(output.page, parent=True),
        problem=lambda wildcards: rule_inputs.hashes_of(FRAMED),
        source=source_hash(REPORTS["framework"].module),
    message:
        "Drawing the framework"
    shell:
        "python -m reports framework --problem {input.problem} --results results"
        " --comparisons {input.comparisons} --out-dir {params.folder} --log {log}"
