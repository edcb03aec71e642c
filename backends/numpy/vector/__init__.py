"""Scalar programs as vectorized LLVM code: lanes, operations, texels, bodies."""
