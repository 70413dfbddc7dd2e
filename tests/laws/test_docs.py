"""Generated pages are up to date, links lead somewhere, and the README leaves no command out."""

import re

import pytest

from camcomp import __version__
from camcomp.ground import shelf
from camcomp.ground.rules import RULES
from camcomp.model.config.key_reference import ROOTS, rows, sections
from camcomp.model.config.schema import config_schema, experiment_schema
from camcomp.terminal import reference
from camcomp.terminal.cli import VERBS
from camcomp.terminal.controls_reference import first_rows
from tests.documents import ROOT, Command, Reader, TypedFile, missing, steps

README = (ROOT / "README.md").read_text(encoding="utf-8")
DOCS = ROOT / "docs"


@pytest.fixture
def reader(tmp_path):
    (tmp_path / "folder").mkdir()
    return Reader(tmp_path / "folder", tmp_path / "tools")


def test_every_kind_of_plug_in_has_a_page():
    assert {"dialect.md", "effect.md", "force-model.md", "machine.md"} <= {
        path.name for path in (DOCS / "how-to").glob("*.md")
    }


CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


def test_contributing_tells_the_checks_that_are_run():
    """Commands of minutes are compared with their runners; all others run below."""
    told = [step.text for step in steps(CONTRIBUTING)]
    ci = (ROOT / ".ci/run").read_text(encoding="utf-8")
    done_anyway = (
        ".ci/run", "venv", "camcomp schema", "camcomp.terminal.reference", "tests.documentation.drawings",
        "tests.report.pictures", "tests.install.pictures", "tests.validation report", "mkdocs build", "git tag", "hatchling build",
            "-m campaign", "-m ecosystem", "-m benchmarks",
    )  # fmt: skip
    rest = [each for each in told if not any(part in each for part in done_anyway)]
    assert len(rest) == 4 and all(each in ci for each in rest)
    assert ".ci/run" in told and all("-e '.[dev]'" in each for each in (README, CONTRIBUTING, ci))


def test_schemas_are_made_as_contributing_says(reader):
    (reader.folder / "config").mkdir()
    for step in steps(CONTRIBUTING):
        if step.text.startswith("camcomp schema"):
            reader.give(step)
    made = sorted(path.name for path in (reader.folder / "config").iterdir())
    assert made == ["camcomp-experiment.schema.json", "camcomp.schema.json"]
    for name in made:
        assert (reader.folder / "config" / name).read_text() == (ROOT / "config" / name).read_text()


def test_paths_in_contributing_are_there():
    for path in re.findall(r"`((?:camcomp|tests|config|samples|docs|\.ci|CHANGELOG)[\w./-]*)`", CONTRIBUTING):
        assert (ROOT / path).exists(), path


def test_the_changelog_is_in_form():
    """Unreleased, then releases from new to old with their days; the version of the package has a section or is none yet."""
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    heads = re.findall(r"^## (.*)$", text, re.MULTILINE)
    assert heads[0] == "Unreleased" and len(heads) > 1
    releases = [re.fullmatch(r"(\d+)\.(\d+)\.(\d+) - (\d{4}-\d\d-\d\d)", each) for each in heads[1:]]
    assert all(releases)
    order = [(tuple(map(int, each.groups()[:3])), each[4]) for each in releases]
    assert order == sorted(order, reverse=True)
    assert set(re.findall(r"^### (.*)$", text, re.MULTILINE)) <= {"Added", "Changed", "Fixed", "Removed"}
    lines = [line for line in text.splitlines()[1:] if line and not line.startswith("#")]
    assert all(line.startswith(("- ", "  ", "What a user sees")) for line in lines)
    sections = re.split(r"^## ", text, flags=re.MULTILINE)[1:]
    assert [each.splitlines()[0] for each in sections[:2] if len(each.strip().splitlines()) > 60] == []
    assert "dev" in __version__ or f"{__version__} - " in "".join(heads[1:])


def anchors(path):
    """Fragments that headings of a page can be reached by."""
    text = re.sub(r"^```.*?^```$", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    heads = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", each.lower()).strip().replace(" ", "-") for each in heads}


PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted(DOCS.rglob("*.md")),
    *sorted((ROOT / "samples").rglob("*.md")),
]


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_links_of_a_page_lead_somewhere(path):
    text = re.sub(r"^```.*?^```$", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    for target, fragment in re.findall(r"\]\(([^)#]*)#?([^)]*)\)", text):
        if "://" in target:
            continue
        other = path.parent / target if target else path
        assert other.exists(), target
        assert not fragment or fragment in anchors(other), f"{target}#{fragment}"


@pytest.mark.parametrize("path", sorted(DOCS.rglob("*.md")), ids=lambda path: path.relative_to(DOCS).as_posix())
def test_pages_of_the_documentation_link_to_pages_only(path):
    """Pages outside of docs/ and samples/ are named and not linked: the built site has only these."""
    for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", path.read_text(encoding="utf-8")):
        other = (path.parent / target).resolve()
        inside = other.is_relative_to(DOCS) or (other.is_relative_to(ROOT / "samples") and other.suffix == ".md")
        assert inside, target


def test_every_folder_of_the_documentation_has_an_index():
    for folder in {path.parent for path in DOCS.rglob("*.md")}:
        assert (folder / "index.md").exists(), folder


def test_the_readme_knows_every_command():
    unnamed = [name for name in VERBS if f"`{name}" not in README and f"`camcomp {name}" not in README]
    assert unnamed == []


@pytest.mark.parametrize("name", sorted(reference.pages()))
def test_reference_pages_are_up_to_date(name):
    assert (reference.FOLDER / name).read_text(encoding="utf-8") == reference.pages()[name], (
        "run `python -m camcomp.terminal.reference`"
    )


def test_the_readme_is_short_and_its_table_of_controllers_is_that_of_the_code():
    assert len(README.splitlines()) <= 200
    assert reference.with_controls(README) == README, "run `python -m camcomp.terminal.reference`"


def test_the_first_table_of_controllers_shows_what_is_read_and_what_is_refused():
    cells = {cell for row in first_rows() for cell in row[1:]}
    assert {"read", "-"} < cells and all(cell in ("read", "-") or cell in RULES for cell in cells)
    assert not [row for row in first_rows() if set(row[1:]) == {"-"}]


def test_the_reference_leaves_nothing_out():
    pages = reference.pages()
    for verb in VERBS:
        assert f"## camcomp {verb}\n" in pages["commands.md"]
    assert "`--report` OUT.html" in pages["commands.md"] and "## camcomp config show" in pages["commands.md"]
    for shelf_name in shelf.SHELVES:
        for member in shelf.members(shelf_name):
            assert f"`{member}`" in pages["library.md"], member
    for path in (ROOT / "config/materials").glob("*.yaml"):
        assert f"`{path.stem}`" in pages["library.md"]
    assert "`orthoglide-1deg.yaml`" in pages["library.md"]


KEYS = [(root, section, row) for _, root in ROOTS for section in sections(root) for row in rows(section)]


def test_every_key_of_the_yaml_files_has_an_example_and_its_unit():
    """A new key without an example: give it one in camcomp/model/config/key_reference.py."""
    bare = [
        (section.paths[0], row.key) for _, section, row in KEYS if not row.example and not row.value.endswith("below")
    ]
    assert bare == []
    units = {row.key: row.unit for _, _, row in KEYS}
    asked = {"origin_mm": "mm", "E_N_per_mm2": "N/mm²", "rotation_Nmm_per_rad": "Nmm/rad", "acceleration_mm_per_s2": "mm/s²",
             "temperature_C": "°C", "spindle_rpm": "rpm", "mass_kg": "kg", "compliance_mm_N_rad": "mm, N, rad", "teeth": ""}  # fmt: skip
    assert {key: units[key] for key in asked} == asked


def test_the_page_of_keys_has_every_key_of_the_schema():
    page = reference.pages()["keys.md"]

    def keys(node):
        if isinstance(node, dict):
            for name, each in node.get("properties", {}).items():
                yield name
                yield from keys(each)
            for name, each in node.items():
                if name != "properties":
                    yield from keys(each)
        elif isinstance(node, list):
            for each in node:
                yield from keys(each)

    effects = {p.name for name, each in shelf.usable("effects") for p in each.PARAMETERS}
    text = {"machine": config_schema(), "experiment": experiment_schema()}
    definitions = text["machine"]["definitions"]
    del definitions["EffectChoice"]
    for name in [name for name in definitions if name.startswith("effects.")]:
        del definitions[name]
    missing = (
        {name for name in keys(text) if f"`{name}`" not in page and f"`{name}: " not in page} - {"source"} - effects
    )
    assert missing == set()


# --- the reader itself ------------------------------------------------------------------------------------------------

DOCUMENT = """
```text title=a.txt
hello
```
```console
$ cat a.txt
hello
$ false  # exit 1
```
"""


def test_a_document_is_files_and_commands():
    assert steps(DOCUMENT) == [
        TypedFile("a.txt", "hello\n"),
        Command("cat a.txt", 6, 0, ["hello"]),
        Command("false", 8, 1),
    ]


def test_the_reader_notices_what_is_not_so(reader):
    reader.follow(DOCUMENT)
    with pytest.raises(AssertionError, match="does not print `goodbye`"):
        reader.follow(DOCUMENT.replace("\nhello\n$", "\ngoodbye\n$"))
    with pytest.raises(AssertionError, match="line 8: `false`"):
        reader.follow(DOCUMENT.replace("  # exit 1", ""))


@pytest.mark.parametrize(
    ("promised", "printed", "lost"),
    [
        (["a", "b"], "a\nb\nc", None),
        (["a", "c"], "a\nb\nc", "c"),
        (["a", "...", "c"], "a\nb\nc", None),
        (["x ... z"], "x y z", None),
        (["a."], "ab", "a."),
        (["...", "a", "b"], "z\na\nx\nb", "b"),
        (["a"], "", "a"),
    ],
)
def test_promises(promised, printed, lost):
    assert missing(promised, printed) == lost
