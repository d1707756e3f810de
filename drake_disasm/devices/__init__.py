"""Devices of the stations: simulated ones, protocols of the real ones, and fakes."""
