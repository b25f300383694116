"""Measurements beside peers, and the robustness run: `python -m bench`."""
