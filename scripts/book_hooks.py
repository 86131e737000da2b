"""Hooks for MkDocs, so that the book renders like the Markdown files on a code hosting site. They adapt anchors of
headings, links to files outside of docs/, and lists that directly follow a line. They also make the search work
without a web server.
"""

import json
import re
from pathlib import Path

from mkdocs.exceptions import PluginError

LINK = re.compile(r"\[([^\]]+)\]\((\.\./[^)\s]+)\)")
ITEM = re.compile(r"(\* |\d+\. )")


def slug(text, separator):
    """Anchor of a heading as on code hosting sites: lower case, hyphens for blanks, no punctuation."""
    kept = re.sub(r"[^\w\- ]", "", text.lower().strip())
    return kept.replace(" ", separator)


def on_config(config):
    config.mdx_configs.setdefault("toc", {})["slugify"] = slug
    return config


def outside(match):
    """Replaces a link to a file outside of docs/ by its text and path, because the file is not a page of the book."""
    text, target = match.group(1), match.group(2).removeprefix("../").split("#")[0]
    return f"`{target}`" if text in (target, target.rsplit("/", 1)[-1]) else f"{text} (`{target}`)"


def on_page_markdown(markdown, **_):
    lines, code = [], False
    for line in markdown.split("\n"):
        code ^= line.startswith("```")
        if not code:
            line = LINK.sub(outside, line)
            before = lines[-1] if lines else ""
            if ITEM.match(line) and before.strip() and not before.startswith((" ", "* ", "|")) and not ITEM.match(before):
                lines.append("")
        lines.append(line)
    return "\n".join(lines)


# MkDocs loads its search index by a request. Browsers refuse such requests for pages opened from a folder. Therefore,
# the search page gets the worker, lunr and the index as one script. The other pages only have a form that leads to the
# search page.
WORKER = 'new Worker(joinUrl(base_url, "search/worker.js"))'
FROM_SCRIPT = "new Worker(URL.createObjectURL(new Blob([book_search])))"
NO_REQUESTS = "loadScripts = function (urls, callback) { callback(); };\ninit = function () { onJSONLoaded.call({ responseText: %s }); };\n"
MAIN = '<script src="./search/main.js"></script>'


def once(text, old, new, where):
    """Replaces a part of a text, and fails unless this part occurs exactly once."""
    if text.count(old) != 1:
        raise PluginError(f"{where}: {old} stands there {text.count(old)} times instead of once: another version of MkDocs?")
    return text.replace(old, new)


def on_post_build(config):
    folder = Path(config.site_dir) / "search"
    lunr, worker, index = ((folder / name).read_text(encoding="utf-8") for name in ("lunr.js", "worker.js", "search_index.json"))
    source = json.dumps("\n".join([lunr, worker, NO_REQUESTS % json.dumps(index)]))
    (folder / "book.js").write_text(f"var book_search = {source};\n", encoding="utf-8")
    main = once((folder / "main.js").read_text(encoding="utf-8"), WORKER, FROM_SCRIPT, "main.js")
    (folder / "main.js").write_text(f'if (typeof book_search === "string") (function () {{\n{main}\n}})();\n', encoding="utf-8")
    page = folder.parent / "search.html"
    text = once(page.read_text(encoding="utf-8"), MAIN, f'<script src="./search/book.js"></script>\n      {MAIN}', "search.html")
    page.write_text(text, encoding="utf-8")
