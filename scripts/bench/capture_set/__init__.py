"""Captures through the stages: finished cells, pages and contact sheets."""
