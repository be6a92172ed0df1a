"""Pages of the documentation that follow from the code: keys of the YAML files, datasets."""
