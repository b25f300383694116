"""What lies over the viewport keeps off the form and off its like, and comes to rest."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QSize
from PySide6.QtWidgets import QWidget

from app.overlying import Evasive
from engine.arrays import F64

pytestmark = pytest.mark.window
NOTHING: F64 = np.zeros((0, 2))


class Card(Evasive):
    """Always of one size."""

    def __init__(self, over: QWidget, form: F64 = NOTHING, size: QSize | None = None) -> None:
        self.form, self.fixed = form, size or QSize(100, 60)
        self.looked = 0
        super().__init__(over, "card", form=self._seen)

    def _seen(self) -> F64:
        self.looked += 1
        return self.form

    def widths(self) -> list[int]:
        return [self.fixed.width()]

    def laid_out(self, width: int) -> QSize:
        return QSize(width, self.fixed.height())


@pytest.fixture
def over(qtbot) -> QWidget:
    """A bare viewport."""
    widget = QWidget()
    qtbot.addWidget(widget)
    widget.resize(300, 200)
    with qtbot.waitExposed(widget):
        widget.show()
    return widget


def at_rest(*cards: Card):
    return lambda: not any(card._soon.isActive() for card in cards)


def test_it_keeps_off_the_form_and_off_what_lies_there(over: QWidget, qtbot) -> None:
    first = Card(over, np.array([[30.0, 30.0]]))  # at the upper left
    first.appear()
    second = Card(over)
    second.appear()
    qtbot.waitUntil(at_rest(first, second))
    assert not first.geometry().contains(30, 30)
    assert not first.geometry().intersects(second.geometry())
    was = first.pos()
    over.resize(500, 400)
    qtbot.waitUntil(at_rest(first, second))
    assert first.pos() != was, "it stays in its corner"
    assert not first.geometry().intersects(second.geometry())


def test_it_stays_where_it_covers_nothing(over: QWidget, qtbot) -> None:
    card = Card(over, np.array([[30.0, 30.0]]))
    card.appear()
    qtbot.waitUntil(at_rest(card))
    was = card.pos()
    card.form = NOTHING  # its first corner is free now
    card.settle()
    assert card.pos() == was


def test_two_that_have_no_room_for_both_come_to_rest(over: QWidget, qtbot) -> None:
    whole = np.indices((30, 20)).reshape(2, -1).T * 10.0
    cards = [Card(over, whole, QSize(260, 150)) for _ in range(2)]
    for card in cards:
        card.appear()
    qtbot.waitUntil(at_rest(*cards))
    looked = [card.looked for card in cards]
    places = [card.geometry() for card in cards]
    for card in cards:
        card.settle()
    qtbot.waitUntil(at_rest(*cards))
    assert [card.geometry() for card in cards] == places
    assert [card.looked for card in cards] == [one + 2 for one in looked], "asked, and no more"
