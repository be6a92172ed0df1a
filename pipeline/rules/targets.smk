# What `snakemake TARGET` may ask for: every study with its presets, every figure of several, and those
# of their products that are asked for.
for target, built in studies.targets().items():

    rule:
        name:
            target
        input:
            f"results/{built}/report/index.html",


for target, pages in rule_inputs.products(sys.argv[1:]).items():

    rule:
        name:
            target
        input:
            pages,
