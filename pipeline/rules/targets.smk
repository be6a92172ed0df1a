# What `snakemake TARGET` may ask for: every study with its presets, every figure of several, and those
# of their products that are asked for. The datasets are named beside the page that shows them:
# Snakemake makes none again that is missing where only a file that is there depends on it.
for target, built in studies.targets().items():

    rule:
        name:
            target
        input:
            partial(rule_inputs.shown_datasets, built),
            f"results/{built}/report/index.html",


for target, pages in rule_inputs.products(sys.argv[1:]).items():

    rule:
        name:
            target
        input:
            pages,
