"""Inputs that no user writes: YAML, experiments, logs and URDFs changed at random, from a seed.

Each function takes a random source and the bytes of a good file and returns changed ones.
"""

from random import Random

WORDS = (
    b"1e308", b"-1e308", b"1e-308", b"1e400", b".inf", b".nan", b"nan", b"inf", b"0", b"-1", b"1_0", b"0x10", b"9" * 400,
    b"null", b"true", b"[]", b"{}", b"[[]]", b"{a: 1}", b"[a, b]", b"''", b'"', b"*a", b"&a", b"&a [*a]", b"<<: *a", b"? ",
    b"!!python/name:os.system", b"!!binary x", b"---", b"...", b"%YAML 9.9", b"#", b": ", b"- ", b"\t", b"|", b">", b"\r",
    b"\n", b"\r\n", b"\0", b"\x1b[2J", b"\xff", b"\xef\xbb\xbf", b"\xe2\x80\xa8", b"\xed\xa0\x80", b",", b";", b"..", b"/", b"-",
    b"type", b"x", b"force", b"effects", b"1.0", b"0.0", b"1e-9", b"1e12", "１".encode(),
)  # fmt: skip
NUMBERS = (
    b"1e308",
    b"-1e308",
    b"1e300",
    b"1e17",
    b"1e9",
    b"1e-300",
    b"nan",
    b"inf",
    b"-inf",
    b"",
    b"0",
    b"-0",
    b"x",
    b"1_0",
)
MARKUP = (
    b"<", b">", b"/>", b"&", b"&a;", b"<!DOCTYPE a [<!ENTITY a 'aaaa'>]>", b"<?xml version='1.0' encoding='no-such'?>",
    b"<?xml version='1.0' encoding='utf-16'?>", b"\n  x: 1", b": ", b"'", b'"', b"#", b"1e308", b"nan", b"inf", b"1_0", b"-1", b"",
    b"0", b"&#10;robot: {}", b"&#0;", b"mimic", b"floating", b"fixed", b"xacro:a",
)  # fmt: skip

DECLARATIONS = tuple(
    b"<?xml version='1.0' encoding='%s'?>" % each
    for each in (b"no-such", b"utf-16", b"hex", b"latin-1", b"ascii", b"utf-7")
)


def mutated_text(random: Random, data: bytes, words: tuple[bytes, ...] = WORDS) -> bytes:
    """Some bytes, words or lines changed, anywhere."""
    out = bytearray(data)
    for _ in range(random.choice((1, 1, 1, 2, 3, 6))):
        at, kind = random.randrange(len(out) + 1), random.randrange(7)
        if kind == 0 and at < len(out):
            out[at] = random.randrange(256)
        elif kind == 1:
            del out[at : at + random.choice((1, 2, 10, 60))]
        elif kind == 2:
            out[at:at] = random.choice(words)
        elif kind == 3:
            lines = out.split(b"\n")
            lines.insert(random.randrange(len(lines)), random.choice(lines))
            out = bytearray(b"\n".join(lines))
        elif kind == 4:
            start = random.randrange(len(out) + 1)
            out[at:at] = out[start : start + random.choice((3, 30))]
        else:
            out = _value_changed(random, out, words)
    return bytes(out)


def _value_changed(random: Random, data: bytearray, words: tuple[bytes, ...]) -> bytearray:
    """One word behind a colon, a comma, a bracket, a quote or a blank replaced."""
    starts = [i + 1 for i, sign in enumerate(data[:-1]) if sign in b":,[{ \"'" and data[i + 1] not in b" ,[{\n"]
    if not starts:
        return data
    start = random.choice(starts)
    end = start
    while end < len(data) and data[end] not in b",]}\n \"'":
        end += 1
    data[start:end] = random.choice(words)
    return data


def mutated_table(random: Random, data: bytes) -> bytes:
    """Cells, columns or rows of a CSV file changed; one time in four its bytes."""
    if random.random() < 0.25:
        return mutated_text(random, data, NUMBERS + WORDS)
    rows = [line.split(b",") for line in data.splitlines()]
    for _ in range(random.choice((1, 1, 2, 4))):
        kind, row = random.randrange(8), random.choice(rows[1:])
        column = random.randrange(len(row))
        if kind < 3:
            row[column] = random.choice(NUMBERS)
        elif kind == 3:  # every eighth row
            value = random.choice(NUMBERS)
            for each in rows[1::8]:
                each[column % len(each)] = value
        elif kind == 4:  # a whole column
            value = random.choice(NUMBERS)
            for each in rows[1:]:
                each[column % len(each)] = value
        elif kind == 5:
            rows[0][column % len(rows[0])] = random.choice((b"", b"t_s", b"line", b"x_mm", b"act_q_mm", b"\xff", b'"'))
        elif kind == 6:
            del rows[random.randrange(1, len(rows)) :]
            if len(rows) < 2:
                rows.append(row)
        else:
            rows.insert(random.randrange(1, len(rows) + 1), list(row))
    return random.choice((b"\n", b"\n", b"\r\n", b"\r")).join(b",".join(row) for row in rows) + b"\n"


def mutated_markup(random: Random, data: bytes) -> bytes:
    """An XML file with attributes, tags or bytes changed, or with another first line."""
    if random.random() < 0.1:
        data = data.replace(data.split(b"\n")[0], random.choice((*DECLARATIONS, *MARKUP)))
    return mutated_text(random, data, MARKUP)
