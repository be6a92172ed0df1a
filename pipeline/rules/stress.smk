# Attempts to break the numbers; make stress does the same, and fails if any answer is wrong.
rule stress:
    input:
        "results/stress/index.html",


rule stress_counts:
    output:
        "results/stress/stress.json",
    log:
        "results/stress/logs/stress.log",
    threads: 1
    params:
        source=lambda wildcards: source_hash("benchmarks.stress.__main__"),
    message:
        "Trying to break the numbers (half an hour)"
    shell:
        "python -m benchmarks.stress --tolerant --out {output} > {log} 2>&1"


rule stress_page:
    input:
        "results/stress/stress.json",
    output:
        "results/stress/stress.csv",
        page="results/stress/index.html",
    log:
        "results/stress/logs/page.log",
    threads: 1
    params:
        folder=subpath(output.page, parent=True),
        source=lambda wildcards: source_hash(REPORTS["stress"].module),
    message:
        "Drawing what came of the attempts to break the numbers"
    shell:
        "python -m reports stress --counts {input} --out-dir {params.folder} --log {log}"
