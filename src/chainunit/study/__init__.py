"""Studies: questions of a drive engineer, answered by the models and their co-simulation."""
