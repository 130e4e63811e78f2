"""Fixtures of the loop's tests."""

from loop_fixtures import plain, shared, spring, spring_file

__all__ = ["plain", "shared", "spring", "spring_file"]
