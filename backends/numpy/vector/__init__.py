"""Scalar programs as LLVM code in vectors: lanes, operations, texels, bodies."""
