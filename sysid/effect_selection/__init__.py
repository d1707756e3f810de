"""Closing the loop: which physical effect a model lacks."""
