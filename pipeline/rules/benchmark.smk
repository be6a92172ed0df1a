# Run time against error, measured anew: suite by suite, so that it resumes. Quiet machines only.
SUITES = config.get(
    "benchmark",
    [
        "precision_fig2",
        "precision_fig4",
        "precision_fig5",
        "precision_fig6",
        "precision_fig7",
    ],
)


rule benchmark:
    input:
        expand("results/benchmark/{suite}.nc", suite=SUITES),
    output:
        "results/benchmark/index.html",
    log:
        "results/benchmark/logs/page.log",
    threads: 1
    params:
        folder=subpath(output[0], parent=True),
        source=lambda wildcards: source_hash("reports.benchmark.build"),
    message:
        "Drawing the benchmarks"
    shell:
        "python -m reports.benchmark.build --datasets {input} --out-dir {params.folder} --log {log}"


rule measure:
    output:
        "results/benchmark/{suite}.nc",
    log:
        "results/benchmark/logs/{suite}.log",
    threads: 1
    params:
        source=lambda wildcards: source_hash("benchmarks.stage"),
    message:
        "Measuring {wildcards.suite}"
    shell:
        "python -m benchmarks.stage {wildcards.suite} --out {output} --log {log}"
