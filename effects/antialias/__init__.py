"""Antialiasing and scaling."""
