"""Options: controls made from the plain fields of a frozen dataclass."""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QSignalBlocker
from PySide6.QtWidgets import (
    QCheckBox,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QSpinBox,
    QWidget,
)

from app.panels.decimal_field import LONGEST, DecimalField, LengthField
from app.panels.panel import GRID, Choice, plain_number


class OptionsRow(QWidget):
    """One control for each field of `options`, in a row; `changed` is called with a new instance.

    bool gives a check box, int and float a number with its unit, Literal a choice, str a text.
    Field metadata: "label", "tip", "min", "max", "step", "unit", "of_size".
    """

    def __init__(self, options: Any, changed: Callable[[Any], None], parent: QWidget | None = None):
        super().__init__(parent)
        self.options = options
        self._changed = changed
        self._controls: dict[str, QWidget] = {}
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(GRID)
        hints = typing.get_type_hints(type(options))
        for one in dataclasses.fields(options):
            label = one.metadata.get("label", one.name.replace("_", " ").capitalize())
            control = self._control(one, hints[one.name], label)
            control.setToolTip(one.metadata.get("tip", ""))
            control.setAccessibleName(label)
            control.setObjectName(f"option {one.name}")
            self._controls[one.name] = control
            if not isinstance(control, QCheckBox):
                row.addWidget(QLabel(label, self))
            row.addWidget(control)

    def _control(self, one: dataclasses.Field[Any], kind: Any, label: str) -> QWidget:
        value = getattr(self.options, one.name)
        meta = one.metadata
        if kind is bool:
            box = QCheckBox(label, self)
            box.setChecked(value)
            box.toggled.connect(lambda on: self._set(one.name, on))
            return box
        if typing.get_origin(kind) is typing.Literal:
            choice = Choice(self)
            for item in typing.get_args(kind):
                choice.addItem(str(item).replace("_", " ").capitalize(), item)
            choice.setCurrentIndex(choice.findData(value))
            choice.activated.connect(lambda _i: self._set(one.name, choice.currentData()))
            return choice
        if "of_size" in meta:
            length = LengthField(self)
            length.setRange(meta.get("min", -LONGEST), meta.get("max", LONGEST))
            length.setValue(value)
            plain_number(length)
            length.valueChanged.connect(lambda v: self._set(one.name, v))
            return length
        if kind in (int, float):
            number: QSpinBox | DecimalField = QSpinBox(self) if kind is int else DecimalField(self)
            number.setRange(meta.get("min", 0), meta.get("max", 1_000_000))
            number.setSingleStep(meta.get("step", 1))
            if isinstance(number, DecimalField):
                number.setDecimals(meta.get("decimals", 2))
            if "unit" in meta:
                number.setSuffix(f" {meta['unit']}")
            number.setValue(value)
            plain_number(number)
            number.valueChanged.connect(lambda v: self._set(one.name, v))
            return number
        text = QLineEdit(str(value), self)
        text.editingFinished.connect(lambda: self._set(one.name, text.text()))
        return text

    def show_options(self, options: Any, unit: str) -> None:
        """Show what was set otherwise than here, and lengths in the unit of the model."""
        self.options = options
        for name, control in self._controls.items():
            value = getattr(options, name)
            with QSignalBlocker(control):
                if isinstance(control, LengthField):
                    control.set_unit(unit)
                if isinstance(control, QSpinBox | DecimalField) and control.value() != value:
                    control.setValue(value)

    def _set(self, name: str, value: Any) -> None:
        self.options = dataclasses.replace(self.options, **{name: value})
        self._changed(self.options)
