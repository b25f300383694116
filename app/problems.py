"""Problems: the one sentence about what went wrong, until the next action."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

from engine import EngineError


class Problems(QObject):
    """Holds the sentence that is shown where the person looks.

    Signals
    -------
    changed(sentence) : there is another sentence, or "" for none.
    bug(error) : a bug of ours came to light; nothing was changed by it.
    """

    changed = Signal(str)
    bug = Signal(object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.sentence = ""

    def say(self, sentence: str) -> None:
        """Show a sentence until the next action."""
        self.sentence = sentence
        self.changed.emit(sentence)

    def report(self, error: Exception) -> None:
        """Show an error: an `EngineError` as it stands, anything else as a bug of ours."""
        if isinstance(error, EngineError):
            self.say(str(error))
        else:
            self.say(
                f"Something went wrong in Eigenform itself ({type(error).__name__}: {error}). "
                "Your document is as it was."
            )
            self.bug.emit(error)

    def clear(self) -> None:
        """Take the sentence away."""
        if self.sentence:
            self.say("")
