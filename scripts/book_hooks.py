"""What MkDocs does differently from a forge, made the same: anchors of headings, links to files outside of docs/, lists after a line."""

import re

LINK = re.compile(r"\[([^\]]+)\]\((\.\./[^)\s]+)\)")
ITEM = re.compile(r"(\* |\d+\. )")


def slug(text, separator):
    """Anchor of a heading as forges make it: small letters, blanks as hyphens, no signs."""
    kept = re.sub(r"[^\w\- ]", "", text.lower().strip())
    return kept.replace(" ", separator)


def on_config(config):
    config.mdx_configs.setdefault("toc", {})["slugify"] = slug
    return config


def outside(match):
    """A link to a file beside docs/ as its text and its path, since the file is no page of the book."""
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
