"""Opens the book from its folder, as a reader without a network does. Tests that pages request only files of the book,
and that the search works.

A few pages are tested. If a second argument names a folder for pictures, all pages are tested, and their pictures
are written.
"""

import json
import sys
import time
from pathlib import Path

from browser import WITHOUT_WEBGL, Browser


def quiet(browser, name):
    foreign = [url for url in browser.asked if not url.startswith(("file:", "data:", "blob:"))]
    assert not browser.logged and not foreign, f"{name}: {browser.logged} {foreign}"


def found(browser, word):
    """Addresses in the search results for a word."""
    browser.value(f"(e => {{ e.value = {json.dumps(word)}; e.dispatchEvent(new Event('keyup')); }})(document.getElementById('mkdocs-search-query'))")
    return browser.value("[...document.querySelectorAll('#mkdocs-search-results a')].map(a => a.getAttribute('href'))")


def main():
    book, pictures = Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None
    with Browser(WITHOUT_WEBGL) as browser:
        browser.size(1300, 1000)
        names = [page.name for page in sorted(book.glob("*.html"))] if pictures else ["index.html", "tutorial.html", "keys.html"]
        for page in [book / name for name in names if name != "404.html"]:  # 404.html is made for a web server.
            browser.open(page)
            assert browser.value("[...document.images].every(image => image.naturalWidth > 0)"), f"{page.name}: a picture is missing"
            quiet(browser, page.name)
            if pictures:
                browser.picture(pictures / f"{page.stem}.png")
        browser.open(book / "search.html")
        deadline, places = time.monotonic() + 20, []
        while not any("task-fibres.html" in place for place in places):
            assert time.monotonic() < deadline, f"the search for tilt finds {places}"
            places = found(browser, "tilt")
            time.sleep(0.1)
        quiet(browser, "search.html")
        if pictures:
            browser.picture(pictures / "search.png")


if __name__ == "__main__":
    main()
