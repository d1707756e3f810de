"""Geometry of the cell: parsing of models, the lock, the tool, coordinates."""
