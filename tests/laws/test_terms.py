"""Terms: public names, and first sentences of docstrings of package and tests, use the words of docs/glossary.md."""

import ast
import re
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

import camcomp
from camcomp.ground.old_names import _MOVED

PACKAGE, TESTS = Path(camcomp.__file__).parent, Path(__file__).parents[1]
# Words that the glossary replaces; aliases of old public names (camcomp/ground/old_names.py) may contain them.
REPLACED = {
    "alike", "beside", "bites", "bulk", "court", "faint", "foresee", "foreseen", "foretell", "grip", "headway", "judges",
    "leftover", "leftovers", "march", "met", "nobody", "nothing", "odd", "push", "slight", "spells", "strange", "strangers",
    "suspect", "suspects", "sways", "told", "wanted",
}  # fmt: skip
# Public names that still contain one of them, as word: number of names. A number may only be lowered.
OPEN_NAMES: dict[str, int] = {}
DOCUMENTED = (ast.FunctionDef, ast.ClassDef, ast.Module)
MOST_HARD_PERCENT, MOST_HARD_PERCENT_OF_ALL = 8, 6  # of the first sentences of a folder, and of all folders
HARD = re.compile(
    r"\bwhat (is|was|it|they|the|a|an|no|every|one|of|has|have|goes|comes|lies|makes|moves|does|stands|shows|acts|leaves|all|there)\b"
    r"|\b(nobody|nothing|no one|told|tells?|telling|beside|left|leftovers?|alike)\b"
    r"|\b(no|not|none|nothing|nobody|without)\b[^.]{0,60}\b(no|not|none|nothing|nobody|without|unless)\b",
    re.IGNORECASE,
)


@cache
def _trees(root):
    files = sorted(root.rglob("*.py"))
    return [(path.relative_to(root), ast.parse(path.read_text(encoding="utf-8"))) for path in files]


def _words(name):
    return re.findall(r"[a-z]+", re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower())


def _public_names():
    """Names of modules, and of the functions, classes and constants at their top, that are public."""
    for path, tree in _trees(PACKAGE):
        yield path.stem
        for node in tree.body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                yield node.name
            elif isinstance(node, ast.Assign):
                for target in node.targets:
                    yield from (each.id for each in ast.walk(target) if isinstance(each, ast.Name))


def test_public_names_have_no_replaced_words():
    old = {name.rpartition(".")[2] for name in _MOVED}
    found = Counter(
        word
        for name in _public_names()
        if not name.startswith("_") and name not in old
        for word in REPLACED.intersection(_words(name))
    )
    assert {word: count for word, count in found.items() if count > OPEN_NAMES.get(word, 0)} == {}


def _hard_sentences(root):
    """Numbers of hard and of all first sentences by folder."""
    hard, count = Counter(), Counter()
    for path, tree in _trees(root):
        folder = "/".join(path.parts[:-1][:2]) or "."
        for node in ast.walk(tree):
            if isinstance(node, DOCUMENTED) and (text := ast.get_docstring(node)):
                first = re.split(r"(?<=[.:])\s", text.strip().replace("\n", " "), maxsplit=1)[0]
                count[folder] += 1
                hard[folder] += bool(HARD.search(first))
    return hard, count


@pytest.mark.parametrize("root", [PACKAGE, TESTS], ids=["package", "tests"])
def test_first_sentences_are_plain(root):
    hard, count = _hard_sentences(root)
    above = {
        folder: f"{100 * hard[folder] / n:.0f} %"
        for folder, n in count.items()
        if hard[folder] > max(1, n * MOST_HARD_PERCENT / 100)
    }
    assert above == {}
    assert hard.total() <= count.total() * MOST_HARD_PERCENT_OF_ALL / 100
