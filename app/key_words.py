"""Key words: a sentence names an action by its id, the person reads the key it has now.

Keys can be given to other actions, so a sentence says `{region.through}` and not “Shift+L”. An
action that has no key is named by its title. Whatever else stands in braces stays as it is.
"""

from __future__ import annotations

import html
import re
from collections.abc import Callable

_NAMED = re.compile(r"\{([a-z_]+\.[\w.-]+)\}")

Read = Callable[[str], str]
"""What a person reads for the id of an action; "" when there is no such action."""


def plain(sentence: str, read: Read) -> str:
    """Return a sentence as it is read."""
    return _NAMED.sub(lambda found: read(found[1]) or found[0], sentence)


def linked(sentence: str, read: Read) -> str:
    """Return a sentence as rich text in which each action is a link to its id."""
    parts, end = [], 0
    for found in _NAMED.finditer(sentence):
        shown = read(found[1])
        if shown:
            parts.append(html.escape(sentence[end : found.start()]))
            parts.append(f'<a href="{found[1]}">{html.escape(shown)}</a>')
            end = found.end()
    return "".join(parts) + html.escape(sentence[end:])
