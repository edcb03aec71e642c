"""Run a plan on a device: inputs, execution, results."""
