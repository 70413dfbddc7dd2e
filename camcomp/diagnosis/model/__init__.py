"""The model of every log: columns of effects, nuisances, a dictionary of discrepancy and noise; docs/explanation/diagnosis-model.md."""
