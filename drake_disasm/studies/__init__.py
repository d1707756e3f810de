"""Studies: several trainings whose comparison answers a question."""
