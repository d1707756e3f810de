"""Logs with undeclared effects, and how often closing the loop names them."""
