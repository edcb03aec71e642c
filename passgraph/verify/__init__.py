"""What holds backends to the meaning: bounds, comparison, the suite, and cases made up at random."""
