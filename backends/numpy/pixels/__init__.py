"""Pixel passes, and chains of them, as loops over pieces of rows."""
