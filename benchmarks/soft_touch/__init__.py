"""Soft-touch: how real a simulated soft body is to a hand. `README.md` in this folder has the rules and the format."""
