"""Texts spoilt at random: what people, editors, disks and converters do to them."""

import re

TOKENS = (
    "nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "null", "~", "true", "[]", "{}", "''", '"', "0x1F", "1_0", "٣", "é",
    "\t", "\x00", "\ufeff", "&a [*a, *a]", "!!python/object:os.system x", "<<: *a", "- ", "? ", "|", ">", "%", "@", "`",
    "999999999999999999999999", "0", "-0", "-1", "1,5", "file: /etc/hostname", "type: {a: b}", "\r", "\u2028", "#", ";",
)  # fmt: skip
NUMBER = re.compile(r"-?\d+\.?\d*(?:e[+-]?\d+)?", re.IGNORECASE)


def mutated(data, rng):
    """One to four random changes to bytes."""
    for _ in range(rng.randint(1, 4)):
        data = rng.choice(_WAYS)(data, rng)
    return data


def _flip(data, rng):
    if not data:
        return data
    k = rng.randrange(len(data))
    return data[:k] + bytes([rng.randrange(256)]) + data[k + 1 :]


def _cut(data, rng):
    a, b = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    return data[:a] if rng.random() < 0.3 else data[:a] + data[min(b, a + 80) :]


def _lines(data, rng):
    lines = data.splitlines(keepends=True)
    if len(lines) < 2:
        return data
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    way = rng.randrange(4)
    if way == 0:
        lines[i], lines[j] = lines[j], lines[i]
    elif way == 1:
        lines.insert(i, lines[j])
    elif way == 2:
        del lines[i]
    else:
        lines[i] = b"  " + lines[i] if rng.random() < 0.5 else lines[i].lstrip()
    return b"".join(lines)


def _token(data, rng):
    k = rng.randrange(len(data) + 1)
    return data[:k] + rng.choice(TOKENS).encode() + data[k:]


def _number(data, rng):
    text = data.decode("utf-8", "surrogateescape")
    found = list(NUMBER.finditer(text))
    if not found:
        return data
    at = rng.choice(found)
    return (text[: at.start()] + rng.choice(TOKENS) + text[at.end() :]).encode("utf-8", "surrogateescape")


def _word(data, rng):
    words = re.split(rb"(\W+)", data)
    if len(words) < 4:
        return data
    i, j = rng.randrange(len(words)), rng.randrange(len(words))
    words[i] = words[j]
    return b"".join(words)


_WAYS = (_flip, _cut, _lines, _token, _number, _number, _word)
