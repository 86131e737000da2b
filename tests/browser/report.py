"""Opens the reports in the folders of a directory in headless Chromium.

Fails if a page logs an error or a warning, makes a request, or is wider than the window. Also fails if a page shows
other numbers than meshio reads from the fields, or than summary.json contains. If a second argument names a folder,
pictures of the pages are written there.
"""

import json
import os
import sys
from pathlib import Path

import meshio
import numpy as np

from browser import WITH_WEBGL, WITHOUT_WEBGL, Browser

# Relative tolerance. The page shows numbers with five digits, and stores them in single precision.
TOLERANCE = 6e-5


def number(text):
    """First number of a text, which may have the page's minus sign U+2212."""
    return float(text.replace("\u2212", "-").split()[0])


def some(values):
    """Returns all values in a thorough test (docs/tests.md), otherwise the first and the last value."""
    return values if "ORTHOWEAR_THOROUGH" in os.environ or len(values) < 3 else [values[0], values[-1]]


def quiet(browser, folder, name):
    asked = [url for url in browser.asked if not url.startswith(("data:", "file:"))]
    assert not browser.logged, f"{name}: {browser.logged}"
    assert not asked and len([url for url in browser.asked if url.startswith("file:")]) == 1, f"{name}: {browser.asked}"


def choose(browser, element, value):
    browser.value(f"(e => {{ e.value = {json.dumps(value)}; e.dispatchEvent(new Event('change')); }})(document.getElementById('{element}'))")


def options(browser, element):
    return browser.value(f"[...document.getElementById('{element}')?.options || []].map(o => o.value)")


def tabs(browser, name, expected):
    ids = browser.value("[...document.querySelectorAll('#tabs button')].map(t => t.id)")
    missing = set(expected) - {tab.removeprefix("tab-") for tab in ids}
    assert not missing, f"{name} has no {missing}"
    for tab in ids:
        browser.value(f"document.getElementById('{tab}').click()")
        shown = browser.value("[...document.querySelectorAll('main > section')].filter(s => s.offsetParent).map(s => s.id)")
        assert shown == [tab.removeprefix("tab-")], f"{name}: {tab} shows {shown}"
        wide = browser.value("document.documentElement.scrollWidth - window.innerWidth")
        assert wide <= 0, f"{name}: {tab} is {wide} pixels wider than the window"
    # The keyboard moves from the last tab to the first.
    browser.value(f"document.getElementById('{ids[-1]}').focus()")
    browser.key("ArrowRight", 39)
    assert browser.value("document.activeElement.id") == ids[0], name


def truth(folder, file):
    """Fields of a frame, as meshio reads them: values of the cells by the name of the field on the page."""
    mesh = meshio.read(folder / f"frame_{file:04}.vtu")
    field = {key: np.concatenate(parts) for key, parts in mesh.cell_data.items()}
    touched = field["status"] > 0
    return {
        "pressure": field["pressure"],
        "tangential": np.hypot(field["traction"][:, 0], field["traction"][:, 1]),
        "slip": np.where(touched, np.hypot(field["slip"][:, 0], field["slip"][:, 1]), 0.0),
        "wear": field["wear_depth"],
        "gap": field["gap"][:, 2],
        "status": field["status"],
    }


def hover(browser, cell):
    """Points at a cell and returns the text of the tooltip."""
    browser.value("document.getElementById('map-canvas').scrollIntoView({block: 'nearest'})")
    x, y = browser.value(f"orthowearReport.map.centre({cell})")
    browser.move(x, y)
    return browser.value("document.getElementById('map-tip').hidden ? '' : document.getElementById('map-tip').textContent")


def maps(browser, folder, least):
    """Compares the maps with the fields. `least` contains the fields that the page must show."""
    said = json.loads((folder / "summary.json").read_text())
    browser.value("document.getElementById('tab-maps').click()")
    seen = set()
    entries = options(browser, "map-entry")
    files = browser.value("JSON.parse(document.getElementById('data').textContent).frames.map(f => [f.file, f.entry])")
    assert len(entries) == len(list(folder.glob("frame_*.vtu"))) == len(files)
    for entry, (file, record) in some(list(zip(entries, files))):
        choose(browser, "map-entry", entry)
        fields = truth(folder, file)
        for key in options(browser, "map-field"):
            choose(browser, "map-field", key)
            if key not in fields:
                continue
            seen.add(key)
            values = fields[key]
            for cell in some([int(np.argmax(values)), len(values) // 2, len(values) // 3]):
                tip = hover(browser, cell)
                if key == "status":
                    assert tip == ["open", "stick", "slip"][int(values[cell])], f"{folder.name}: {tip} at {cell}"
                    continue
                found = number(tip.split(": ")[1])
                right = values[cell]
                assert abs(found - right) <= TOLERANCE * abs(right), f"{folder.name}, {file}: {tip} at {cell}, {right} in the file"
                same = number(browser.value("document.getElementById('map-value').cells[1].textContent"))
                assert same == found, f"{folder.name}: {same} beside {found}"
        # `peak_pressure` of a wear jump is the mean of both reversal points, and may differ from the peak of the map.
        if "jump" not in said["steps"][record]:
            peak = said["steps"][record]["peak_pressure"]
            choose(browser, "map-field", "pressure")
            found = number(hover(browser, int(np.argmax(fields["pressure"]))).split(": ")[1])
            assert abs(found - peak) <= TOLERANCE * peak, f"{folder.name}: {found} instead of {peak}"
    assert seen >= least, f"{folder.name}: only maps of {seen}"
    browser.value("document.getElementById('map-canvas').focus()")
    before = browser.value("document.querySelector('#map-readout td').textContent")
    browser.key("ArrowLeft", 37)
    assert browser.value("document.querySelector('#map-readout td').textContent") != before, "the arrow keys do not move"


def colours(browser):
    """Number of different colours in the 3D view."""
    return browser.value(
        "(() => { const from = document.querySelector('#view-box canvas'), to = document.createElement('canvas'); to.width = to.height = 200;"
        "const c = to.getContext('2d'); c.drawImage(from, 0, 0, 200, 200); return new Set(new Uint32Array(c.getImageData(0, 0, 200, 200).data.buffer)).size; })()"
    )


def view_note(browser):
    browser.value("document.getElementById('tab-view').click()")
    return browser.value("document.getElementById('view-note').textContent")


def view(browser, name):
    assert "needs WebGL" not in view_note(browser), name
    for element in ["view-entry", "view-field"]:
        for value in some(options(browser, element)):
            choose(browser, element, value)
            assert not value.startswith("body:") or colours(browser) > 5, f"{name}: {value} shows nothing"
    choose(browser, "view-field", options(browser, "view-field")[0])
    browser.value("document.getElementById('view-near').click()")
    assert colours(browser) > 20, f"{name}: an empty view"
    for slider in ["view-lift", "view-scale", "view-relief"]:
        browser.value(f"(e => {{ e.value = 60; e.dispatchEvent(new Event('input')); }})(document.getElementById('{slider}'))")
    for box in ["view-body1", "view-body2"]:
        browser.value(f"document.getElementById('{box}').click()")
    browser.value("document.getElementById('view-box').focus()")
    browser.key("ArrowLeft", 37)
    browser.value("document.getElementById('view-reset').click()")


RUN = {"overview", "scene", "maps", "view", "plots", "convergence", "plan", "tables"}
PAGES = {
    "run": (RUN, "Converged", {"pressure", "tangential", "slip", "wear", "gap", "status"}),
    "meshed": (RUN, "Converged", {"pressure", "tangential", "gap", "status"}),
    "sliding": (RUN, "NOT CONVERGED", {"pressure", "tangential"}),
    "failed": ({"overview", "scene"}, "FAILED. Nothing was computed.", None),
    "compare": ({"overview", "plots", "tables"}, "All 2 variants converged", None),
}


def main():
    base, pictures = Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None
    with Browser(WITH_WEBGL) as browser:
        for name, (expected, status, least) in PAGES.items():
            folder = base / name
            for width, height in [(400, 800), (1280, 900)] if name in ("run", "compare") else [(1280, 900)]:
                browser.size(width, height)
                browser.open(folder / "report.html")
                said = json.loads((folder / ("compare.json" if name == "compare" else "summary.json")).read_text())
                assert browser.value("document.querySelector('h1').textContent") == (said["title"] or "Results without a title")
                assert status in browser.value("document.getElementById('status').textContent"), name
                assert browser.value("document.getElementsByTagName('script').length") == (2 if least is None else 4), name
                tabs(browser, name, expected)
                quiet(browser, folder, name)
            if least is not None:
                maps(browser, folder, least)
                view(browser, name)
            if pictures:
                for tab in expected:
                    browser.value(f"document.getElementById('tab-{tab}').click()")
                    browser.picture(pictures / f"{name}-{tab}.png")
            pdf = browser.pdf()
            assert pdf.startswith(b"%PDF") and len(pdf) > 10_000, name
            quiet(browser, folder, name)
    with Browser(WITHOUT_WEBGL) as browser:
        browser.size(1280, 900)
        browser.open(base / "meshed/report.html")
        assert "needs WebGL" in view_note(browser)
        assert browser.value("document.getElementById('view-box').offsetParent === null"), "the 3D view is shown without WebGL"
        quiet(browser, base / "meshed", "meshed without WebGL")


main()
