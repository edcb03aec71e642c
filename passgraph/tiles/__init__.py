"""Compute pictures larger than memory tile by tile: files, Zarr, dask arrays, and workers of a cluster."""
