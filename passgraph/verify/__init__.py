"""Verification of backends: bounds, comparison, the conformance suite, and fuzzing."""
