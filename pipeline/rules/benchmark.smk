# Run time against error, measured anew: suite by suite, so that it resumes. Quiet machines only.
# Others with --config benchmark='[precision_small_push]', videos with --config videos=FOLDER.
SUITES = config.get(
    "benchmark",
    [
        *expand("precision_{scene}", scene=["fig2", "fig4", "fig5", "fig6", "fig7"]),
        *expand("optimisers_{scene}", scene=["fig2", "fig4", "fig5"]),
        "growth",
        "cases",
        "ablation",
        "tracking",
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
        source=lambda wildcards: source_hash(REPORTS["benchmark"].module),
    message:
        "Drawing the benchmarks"
    shell:
        "python -m reports benchmark --datasets {input} --out-dir {params.folder} --log {log}"


rule measure:
    output:
        "results/benchmark/{suite}.nc",
    log:
        "results/benchmark/logs/{suite}.log",
    threads: 1
    params:
        videos=config.get("videos", "tests/data/tracking"),
        folder=subpath(output[0], parent=True),
        source=lambda wildcards: source_hash("benchmarks.__main__"),
    message:
        "Measuring {wildcards.suite}"
    shell:
        "python -m benchmarks {wildcards.suite} --videos {params.videos:q} --out {params.folder}"
        " --log {log} > /dev/null"
