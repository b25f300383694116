"""The viewport: what is seen of a form, and what the hands do on it."""

from app.viewport.widget import Viewport

__all__ = ["Viewport"]
