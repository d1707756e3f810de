"""The one confidence level of all intervals: 95 %, two-sided."""

from scipy.stats import norm

LEVEL = 0.95
#: Quantiles of draws that bound an interval.
QUANTILES = (0.025, 0.975)
#: Half width of an interval in standard deviations of a Gaussian.
Z = float(norm.ppf(QUANTILES[1]))
