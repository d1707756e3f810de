"""Fits a model to a log, and judges the fit."""
