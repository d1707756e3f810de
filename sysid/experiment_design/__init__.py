"""Motions that show what is to be identified: designed before anything is recorded."""
