"""The digital twin as functions of arrays: one description, one step, one settling."""
