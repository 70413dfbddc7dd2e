"""The report in a real browser: everything drawn, nothing complained about, usable by keyboard and screen reader."""

import numpy as np
import pytest

from tests.report.browser import needs_browser

pytestmark = needs_browser
HOME, RIGHT = "\ue011", "\ue014"
# A remark of the browser about the way the plot library measures letters, not about anything we can change.
NOT_OURS = "willReadFrequently"


@pytest.fixture
def page(browser, report):
    browser.resize(1100, 900)
    browser.console()
    browser.open(report)
    return browser


def complaints(page):
    return [each for each in page.console() if NOT_OURS not in each]


def curves(page, plot):
    """(x, y) of every curve as plotly holds it."""
    script = "return document.getElementById(arguments[0]).data.map(t => [t.x, t.y])"
    return [np.array([x, y], float) for x, y in page.run(script, plot)]


def test_every_plot_is_drawn_and_nothing_complains(page):
    drawn = page.run(
        "return [...document.querySelectorAll('.plot')].map(p => [p.id, p.querySelectorAll('.main-svg').length,"
        " p.querySelectorAll('path.js-line, .bars path, canvas').length, p.dataset.drawn])"
    )
    assert len(drawn) == 8
    for name, pictures, marks, done in drawn:
        assert pictures and marks and done == "yes", name
    assert complaints(page) == []


def test_a_broken_script_is_noticed(page, tmp_path, report):
    bad = tmp_path / "bad.html"
    bad.write_text(report.read_text().replace("await draw(spec);", "await draw(spec); console.error('planted');"))
    page.open(bad)
    assert any("planted" in each for each in complaints(page))


def test_nothing_is_fetched(page, tmp_path, report):
    assert page.run("return performance.getEntriesByType('resource').length") == 0
    bad = tmp_path / "bad.html"
    bad.write_text(report.read_text().replace("<main", "<img src='http://127.0.0.1:9/x.png' alt=''><main", 1))
    page.open(bad)
    assert any("Content Security Policy" in each for each in complaints(page))


def test_the_slider_enlarges_true_deviations(page):
    page.press("trajectories-k", HOME)
    assert page.run("return document.getElementById('trajectories-o').textContent") == "1.0 times"
    target, *true = curves(page, "trajectories-plot")
    page.press("trajectories-k", *[RIGHT] * 30)
    told = page.run("return document.getElementById('trajectories-k').getAttribute('aria-valuetext')")
    factor = float(told.split()[0])
    assert factor == pytest.approx(10 ** (5 * 0.30), rel=0.02)
    again, *enlarged = curves(page, "trajectories-plot")
    assert np.array_equal(again, target, equal_nan=True)
    for before, after in zip(true, enlarged, strict=True):
        assert np.nanmax(np.abs(before - target)) > 1e-3
        assert after - target == pytest.approx(10 ** (5 * 0.30) * (before - target), rel=1e-6, abs=1e-6, nan_ok=True)


def test_the_plane_is_chosen(page):
    page.run(
        "const p = document.getElementById('trajectories-p'); p.value = 'YZ'; p.dispatchEvent(new Event('change'))"
    )
    titles = page.run(
        "return ['xaxis', 'yaxis'].map(a => document.getElementById('trajectories-plot').layout[a].title.text)"
    )
    assert titles == ["y in mm", "z in mm"]
    assert np.nanmax(curves(page, "trajectories-plot")[0][1]) > 4  # the retract of the program


def test_labels_for_screen_readers(page):
    labels = page.run("return [...document.querySelectorAll('.plot')].map(p => [p.role, p.ariaLabel])")
    assert all(role == "img" and len(label) > 30 for role, label in labels)
    assert len({label for _, label in labels}) == len(labels)
    assert page.run("return document.documentElement.lang") == "en"
    unnamed = (
        "return [...document.querySelectorAll('input, select, button:not(.modebar-btn)')]"
        ".filter(e => !(e.labels && e.labels.length) && !e.textContent.trim()).length"
    )
    assert page.run(unnamed) == 0
    levels = page.run("return [...document.querySelectorAll('h1, h2, h3')].map(h => Number(h.tagName[1]))")
    assert levels[0] == 1 and levels.count(1) == 1 and max(np.diff(levels)) == 1
    assert page.run("return document.querySelectorAll('th:not([scope])').length") == 0


def test_everything_is_reached_by_tab(page):
    page.run("document.activeElement.blur(); window.scrollTo(0, 0)")
    reached = [page.tab() for _ in range(40)]
    assert {"theme", "trajectories-k", "trajectories-p"} <= set(reached)
    assert reached[0] == "A" and "BUTTON" in reached  # the skip link; heads of the sortable table


def test_a_table_is_sorted_by_its_heads(page):
    script = (
        "const t = document.querySelector('table.sortable'); t.tHead.rows[0].cells[2].firstChild.click();"
        "return [t.tHead.rows[0].cells[2].ariaSort, [...t.tBodies[0].rows].map(r => Number(r.cells[2].dataset.v))]"
    )
    how, values = page.run(script)
    assert how == "descending" and values == sorted(values, reverse=True) and len(set(values)) > 2
    how, values = page.run(script)
    assert how == "ascending" and values == sorted(values)


def test_dark_and_light(page):
    script = (
        "const s = getComputedStyle(document.body); const p = document.getElementById('shift-plot');"
        "return [s.backgroundColor, p.layout.font.color, p.data[0].line.color]"
    )
    light = page.run(script)
    page.press("theme", "\ue007")
    dark = page.run(script)
    assert len({*light, *dark}) == 6
    assert page.run("return document.getElementById('theme').textContent") == "Light colours"


def test_narrow_windows_scroll_down_only(page):
    page.resize(500, 900)
    page._call("GET", "/status")
    wide = page.run(
        "return new Promise(done => setTimeout(() => done(["
        "document.documentElement.scrollWidth, document.documentElement.clientWidth]), 700))"
    )
    assert wide[0] <= wide[1]


def test_it_prints(page):
    data = page.pdf()
    assert data.startswith(b"%PDF") and 3 <= data.count(b"/Type /Page\n") + data.count(b"/Type/Page/") <= 25
