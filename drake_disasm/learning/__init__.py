"""Learning by trial and error, and from data."""
