"""Pages of docs/validation and the README's lines, from stored results alone."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from tests.validation import counting, speed, store
from tests.validation.generators import GENERATORS, WANTED
from tests.validation.runner import ROOT
from tests.validation.scoring import wilson

PAGES = ROOT / "docs" / "validation"
MARKS = ("<!-- validation -->", "<!-- /validation -->")
PLOTTED = ("whole answer right", "false cause with p above 0.5", "95 % interval holds the true value")
COLOURS = ("#0072b2", "#d55e00", "#009e73")
Result = dict[str, Any]

INDEX = """# Validation

How often is the diagnosis right, and on what was that judged? These pages are written by `python -m tests.validation report`
from the results that `python -m tests.validation run NAME` stores.

Plants that stand for real machines share no code with camcomp. Every experiment has a seed that no code was tuned on, and each
table is of one code. Rates come with Wilson intervals of 95 %.

{lines}

| page | experiments | code | whole answer right |
|---|---|---|---|
{rows}
{measured}"""
LINK = "\n[Measured data](measured.md): real machines, judged on runs that the fit has not seen, with textbook models on the same split.\n"
TIMED = "\n[Speed](speed.md): time per line of programs of 10 to 10 000 000 lines.\n"
PAGE = """# {title}

{about}

{experiments} experiments, seeds {first} to {last}, code `{commit}` of {date}; next free seed {next}.
`python -m tests.validation run {name} --count N` adds more.

| rate | hits | rate | 95 % interval | wanted |
|---|---|---|---|---|
{rows}
{more}"""
MEASURED = """# Measured data

camcomp and textbook models are fitted to some runs of a real machine and judged on a run that neither has seen. Code `{commit}`
of {date}; `python -m tests.validation run measured` asks anew. All figures are rms on the judged run. *File* is what the
machine file leaves that `--write-config` writes. The ratio is camcomp over the first opponent of a row, which was named in
advance; *best* is the opponent that is best on the judged run. {summary}

| data | fitted to judged | quantity | nominal | camcomp | file | opponents | ratio | best | answer |
|---|---|---|---|---|---|---|---|---|---|
{rows}

| data | source |
|---|---|
| ur5 | UR5 and laser tracker, 1000 poses on a grid and 20 others; P. Jacobi, MIT |
| ur10 | UR10 and laser tracker, two campaigns; sample of the IPA robot accuracy data, C. Landgraf, MIT |
| kr300 | KUKA KR300 R2500 ultra, set-points and encoders at 4 ms, two runs; J. Weigand, MIT |
| uart_servo | one servo at 10 Hz, two runs; roboninecom, CC BY 4.0 |
| emps | ball-screw axis at 1 kHz, two halves of one run; Janot, Gautier, Brunot 2019, not part of camcomp |

Opponents of arms: ridge regression of five link parameters per joint (prior 1 mm and 1 mrad, noise 0.1 mm), with joint
compliances under weight, with two harmonics per joint. Opponents of axes: least squares of speed, acceleration, Coulomb
friction, offset and weight by angle; the same with a ridge; without weight; a first-order lag; a speed limit.
"""


def rate(hits: int, total: int) -> str:
    """A rate with its interval, for running text."""
    low, high = wilson(hits, total)
    return f"{hits} of {total} ({low:.2f} to {high:.2f})"


def page(name: str, results: list[Result]) -> str:
    """The page of a generator: the newest code's table, and the course over codes."""
    newest, generator = results[-1], GENERATORS[name]
    rows = []
    for label, (hits, total) in sorted(newest["counts"].items(), key=lambda each: _order(each[0])):
        low, high = wilson(hits, total)
        rows.append(
            f"| {label} | {hits} of {total} | {hits / total:.3f} | {low:.3f} to {high:.3f} | {WANTED.get(label, '')} |"
        )
    missed, causes = counting.calibration_error(newest["calibration"])
    if causes:
        chance = counting.expected_by_chance(newest["calibration"])
        rows.append(
            f"| expected calibration error of {causes} probabilities | | {missed:.3f} | "
            f"{chance:.3f} if all were right | at most 0.05 |"
        )
    more = ""
    if newest.get("seconds"):
        more += f"\nMean time of an answer: {newest['seconds'] / newest['experiments']:.1f} s on one core.\n"
    if newest.get("misses"):
        more += "\n## Answers that were wrong\n\n| seed | kind, truth, answer |\n|---|---|\n"
        more += "".join(f"| {seed} | {_plain(text)} |\n" for seed, text in newest["misses"])
    if plot(results):
        more += f"\n## Over codes\n\n![rates over codes]({name.replace('_', '-')}.svg)\n"
    return PAGE.format(
        title=generator.title, about=generator.about, experiments=newest["experiments"], first=newest["first_seed"],
        last=newest["next_seed"] - 1, next=newest["next_seed"], commit=newest["commit"], date=newest["date"][:10], name=name,
        rows="\n".join(rows), more=more,
    )  # fmt: skip


def _order(label: str) -> tuple[int, str]:
    wanted = list(WANTED)
    return (wanted.index(label) if label in wanted else len(wanted), label)


def _plain(text: str) -> str:
    return (
        re.sub(r"\s+", " ", text)
        .replace("|", "/")
        .replace("<", "&lt;")
        .replace("[", "&#91;")
        .replace("'", "")
        .replace('"', "")[:240]
    )


def plot(results: list[Result]) -> str:
    """An SVG of rates with Wilson bars, one step per code; empty where no rate is plotted."""
    shown = [label for label in PLOTTED if any(label in each["counts"] for each in results)]
    if not shown:
        return ""
    wide, high, left, top = max(420, 120 + 90 * len(results)), 260, 60, 20
    tall = high - 80

    def y(value: float) -> float:
        return top + tall * (1 - value)

    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide} {high + 20 * len(shown)}" font-family="sans-serif" font-size="11">'
    ]
    out.append(f'<rect width="{wide}" height="{high + 20 * len(shown)}" fill="white"/>')
    for tick in (0.0, 0.25, 0.5, 0.75, 1.0):
        out.append(f'<line x1="{left}" x2="{wide - 10}" y1="{y(tick):.1f}" y2="{y(tick):.1f}" stroke="#ccc"/>')
        out.append(f'<text x="{left - 8}" y="{y(tick) + 4:.1f}" text-anchor="end">{tick:g}</text>')
    for i, each in enumerate(results):
        x = left + 40 + 90 * i
        out.append(f'<text x="{x}" y="{top + tall + 18}" text-anchor="middle">{each["commit"][:8]}</text>')
        out.append(f'<text x="{x}" y="{top + tall + 32}" text-anchor="middle">n = {each["experiments"]}</text>')
        for k, label in enumerate(shown):
            if label in each["counts"]:
                hits, total = each["counts"][label]
                lower, upper = wilson(hits, total)
                at, colour = x + 12 * (k - 1), COLOURS[k]
                out.append(
                    f'<line x1="{at}" x2="{at}" y1="{y(lower):.1f}" y2="{y(upper):.1f}" stroke="{colour}" stroke-width="2"/>'
                )
                out.append(f'<circle cx="{at}" cy="{y(hits / total):.1f}" r="4" fill="{colour}"/>')
    for k, label in enumerate(shown):
        out.append(f'<circle cx="{left}" cy="{high + 20 * k - 4}" r="4" fill="{COLOURS[k]}"/>')
        out.append(f'<text x="{left + 10}" y="{high + 20 * k}">{label}</text>')
    return "\n".join([*out, "</svg>", ""])


def measured(result: Result) -> str:
    """The page of the measured data."""
    rows = []
    for row in result["rows"]:
        figures = [
            f"{row[key]:.4g} {row['unit']}" if row[key] is not None else "" for key in ("nominal", "camcomp", "file")
        ]
        others = ", ".join(f"{name} {value:.4g}" for name, value in row["opponents"].items())
        ratio = f"{row['ratio']:.2f} ({row['verdict']})" if row["ratio"] else row["verdict"]
        causes = f": {', '.join(row['causes'])}" if row["causes"] else ""
        rows.append(
            f"| {row['set']} | {row['split']} | {row['quantity']} | {' | '.join(figures)} | {others} | {ratio} | {row['best']} "
            f"| {row['answer']}{causes} |"
        )
    return MEASURED.format(
        commit=result["commit"], date=result["date"][:10], summary=_summary(result) + ".", rows="\n".join(rows)
    )


def _summary(result: Result) -> str:
    good = sum(row["verdict"] in ("better", "equal") for row in result["rows"])
    return f"camcomp is at most 3 % worse than the named textbook model in {good} of {len(result['rows'])} quantities"


def readme_lines() -> list[str]:
    """The three lines of the README, as items of a list."""
    newest = {name: results[-1] for name in (*GENERATORS, "measured") if (results := store.all_of(name))}

    def of(names: tuple[str, ...], label: str) -> tuple[int, int]:
        counts = [newest[n]["counts"][label] for n in names if n in newest and label in newest[n]["counts"]]
        return sum(c[0] for c in counts), sum(c[1] for c in counts)

    lines = []
    for title, names in (
        ("Simulated programs", ("programs", "recorded")),
        ("Logs of axes and static poses", ("axes", "poses")),
    ):
        right, wrong = of(names, "whole answer right"), of(names, "false cause with p above 0.5")
        if right[1]:
            lines.append(f"- {title}: right answer in {rate(*right)}, a false cause in {rate(*wrong)}.")
    if "measured" in newest:
        lines.append(f"- Measured data of five machines: {_summary(newest['measured'])}.")
    return lines


def pages() -> dict[Path, str]:
    """Every generated file and its text."""
    out, rows = {}, []
    for name, generator in GENERATORS.items():
        results = store.all_of(name)
        if results:
            file = name.replace("_", "-")
            out[PAGES / f"{file}.md"] = page(name, results)
            if picture := plot(results):
                out[PAGES / f"{file}.svg"] = picture
            right = results[-1]["counts"].get("whole answer right")
            rows.append(
                f"| [{generator.title}]({file}.md) | {results[-1]['experiments']} | `{results[-1]['commit']}` | "
                f"{rate(*right) if right else ''} |"
            )
    on_real = store.all_of("measured")
    if on_real:
        out[PAGES / "measured.md"] = measured(on_real[-1])
    links = LINK if on_real else ""
    if timed := store.all_of("speed"):
        out[PAGES / "speed.md"], out[PAGES / "speed.svg"] = speed.page(timed[-1]), speed.plot(timed[-1])
        links += TIMED
    out[PAGES / "index.md"] = INDEX.format(lines="\n".join(readme_lines()), rows="\n".join(rows), measured=links)
    return out


def with_lines(readme: str) -> str:
    """The README with its generated lines; unchanged where it has no marks for them."""
    begin, end = MARKS
    if begin not in readme:
        return readme
    head, rest = readme.split(begin, 1)
    return f"{head}{begin}\n" + "\n".join(readme_lines()) + f"\n{end}{rest.split(end, 1)[1]}"


def write() -> list[Path]:
    """Write all pages and the README's lines; the paths."""
    texts = pages()
    readme = ROOT / "README.md"
    texts[readme] = with_lines(readme.read_text(encoding="utf-8"))
    for path, text in texts.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return list(texts)
