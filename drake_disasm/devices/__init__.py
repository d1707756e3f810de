"""Devices of the station, simulated; the real ones' protocols join them later."""
