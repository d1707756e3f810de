"""Fits a model with chosen effects to its log.

candidates     effects that a model may lack, and the model extended by them
fitter         fits a model with effects; fit_cache keeps fits on disk
fit            a fitted model, how well its parameters are determined
block_grams    sufficient statistics of blocks of rows: losses, covariances
settings       all thresholds of effect selection
"""
