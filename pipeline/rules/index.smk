# Every figure and movie of the paper, and the page over them.
rule all:
    input:
        [partial(rule_inputs.shown_datasets, figure) for figure in studies.figures()],
        expand(
            "results/{figure}/report/index.html", figure=["fig1", *studies.figures()]
        ),
        expand("results/movies/{movie}.mp4", movie=MOVIES),
    output:
        "results/index.html",
    log:
        "results/logs/index.log",
    threads: 1
    params:
        source=source_hash(REPORTS["index"].module),
    message:
        "Drawing the index of results"
    shell:
        "python -m reports index --results results --log {log}"


# The same page over what is there now. It has no output, so it always runs when it is asked for.
rule index:
    log:
        "results/logs/index.log",
    threads: 1
    message:
        "Drawing the index of what is there"
    shell:
        "python -m reports index --results results --log {log}"
