"""Editors on the YAML files, by the schemas that camcomp ships."""
