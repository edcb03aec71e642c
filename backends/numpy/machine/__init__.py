"""Machine code, threads and memory; independent of kernels."""
