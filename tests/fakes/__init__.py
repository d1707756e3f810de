"""Devices that tests talk to over loopback sockets, and that fail on demand."""
