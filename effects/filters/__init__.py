"""Blurs, sharpening, noise removal, edges and shapes."""
