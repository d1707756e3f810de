"""Diagnoses of hidden worlds, judged; see `judge`."""
