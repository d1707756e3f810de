"""Watches a robot: judges each new episode against a reference that was in order."""
