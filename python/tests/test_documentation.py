"""The examples on the documentation page of the package print the output that the page shows."""

import base64
import importlib.machinery
import importlib.util
import io
import re
import shutil
import sys
from contextlib import redirect_stdout

import numpy as np
import pytest
from conftest import ROOT, needed

PAGE = ROOT / "docs" / "python.md"


@pytest.fixture(scope="module")
def examples():
    """The module of scripts/examples, which parses the blocks and compares their output."""
    if sys.version_info < (3, 11):
        pytest.skip("scripts/examples needs Python 3.11")
    loader = importlib.machinery.SourceFileLoader("examples", str(ROOT / "scripts" / "examples"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("examples", loader))
    loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def folder(tmp_path_factory, examples):
    """Folder where the blocks were run in order, with copies of scenes/ and meshes/."""
    needed("matplotlib").use("agg")
    for name in ("gmsh", "meshio", "pandas", "xarray"):
        needed(name)
    folder = tmp_path_factory.mktemp("page")
    for name in ("scenes", "meshes"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("*.out", "*.study"))
    names: dict = {}
    printed: list = []
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for i, (language, body) in enumerate(examples.BLOCK.findall(PAGE.read_text(encoding="utf-8"))):
            if language == "python":
                heard = io.StringIO()
                with redirect_stdout(heard):
                    exec(compile(body, f"{PAGE.name}, block {i}", "exec"), names)
                printed = heard.getvalue().splitlines()
            elif language == "text":
                missing = [line for line in body.splitlines() if line.strip() and not examples.stands(line, printed)]
                assert not missing, f"block {i}: not printed: {missing}, but {printed}"
    needed("matplotlib.pyplot").close("all")
    return folder


def test_blocks(folder):
    """Truth: the fixture `folder` compares the output of the blocks with the page. The blocks also make the picture."""
    assert (folder / "python-plots.svg").exists()


def test_picture_is_current(folder):
    """Truth: the picture in docs/ equals the picture that a block of the page makes. Machines may differ in the last
    digits. Therefore, numbers in the SVG must agree within 0.01, and maps within 1 of 255 levels on average.
    """
    version = re.search(r"^matplotlib==(\S+)", (ROOT / "scripts" / "requirements.txt").read_text(), re.M)[1]
    if needed("matplotlib").__version__ != version:
        pytest.skip(f"the picture is made with matplotlib {version}")
    from PIL import Image

    made, shown = ((place / "python-plots.svg").read_text(encoding="utf-8") for place in (folder, ROOT / "docs"))
    image = re.compile(r'data:image/png;base64,([^"]*)"')
    pixels = [
        [np.asarray(Image.open(io.BytesIO(base64.b64decode(found)))).astype(float) for found in image.findall(text)]
        for text in (made, shown)
    ]
    assert len(pixels[0]) == len(pixels[1]) == 3
    for a, b in zip(*pixels, strict=True):
        assert a.shape == b.shape and np.abs(a - b).mean() < 1.0
    number = re.compile(r"(?<![#\w])-?\d+\.?\d*(?:e-?\d+)?")
    # Element ids are hashes of the content. They are removed, because they change with the last digits.
    texts = [re.sub(r'(id="|#|url\(#)\w+', r"\1", image.sub("", text)) for text in (made, shown)]
    assert number.sub("0", texts[0]) == number.sub("0", texts[1])
    values = [np.array(number.findall(text), dtype=float) for text in texts]
    assert np.allclose(values[0], values[1], rtol=0, atol=0.01)
