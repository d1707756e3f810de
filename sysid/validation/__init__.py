"""Logs with effects that nobody declares, and how often they are found."""
