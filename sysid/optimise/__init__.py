"""Derivative-free minimisation within a box: the Bees Algorithm and NLopt.

Each search takes a function of a *batch* of points, which may evaluate them in
parallel, and returns a `Trace` of all evaluations.
"""

from sysid.optimise.bees import BeesAlgorithm, BeesSettings
from sysid.optimise.coordinates import Box, Whitened
from sysid.optimise.nlopt_search import nlopt_search
from sysid.optimise.trace import Trace

__all__ = ["BeesAlgorithm", "BeesSettings", "Box", "Trace", "Whitened", "nlopt_search"]
