"""Pictures larger than memory and arrays of chunks, tile by tile: files, Zarr, dask, and workers elsewhere."""
