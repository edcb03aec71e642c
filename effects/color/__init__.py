"""Effects on color: exposure, grading, tone mapping, color spaces."""
