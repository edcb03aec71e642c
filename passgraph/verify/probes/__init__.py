"""Probes: small programs whose results show facts about a driver, beside what specifications say."""
