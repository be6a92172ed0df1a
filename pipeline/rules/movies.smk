# The paper's movies, of the studies that there are; every study in full, with its recordings.
rule movie:
    input:
        datasets=lambda wildcards: datasets_of(movies()[wildcards.movie]),
        comparisons=lambda wildcards: comparisons_of(movies()[wildcards.movie]),
    output:
        "results/movies/{movie}.mp4",
    log:
        "results/logs/movie_{movie}.log",
    threads: 1
    params:
        problems=lambda wildcards: [
            study.problem for study in movies()[wildcards.movie]
        ],
        problem=lambda wildcards: hashes_of(movies()[wildcards.movie]),
        source=source_hash("reports.products.movie.build"),
    message:
        "Drawing movie {wildcards.movie}"
    shell:
        "python -m reports.products.movie.build --problems {params.problems} --results results"
        " --comparisons {input.comparisons} --out {output} --log {log}"


rule movies:
    input:
        expand("results/movies/{movie}.mp4", movie=movies()),
