"""Stylized pictures: dots, strokes, squares, screens."""
