"""Hosts for the JavaScript of models: node, and a page of Chromium.

A script returns a value as JSON has it; ``coded(numbers)`` keeps the bits of an array, which is an array here. It has
the `models` by name, and what is `given` to it, where arrays are arrays of doubles there.
"""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pytest
from browser import CHROMIUM, Page

from chainunit.core.printing.javascript import model_text, program

NODE = shutil.which("node")
node = pytest.mark.skipif(NODE is None, reason="no node, which runs JavaScript as a browser does")
chromium = pytest.mark.skipif(CHROMIUM is None, reason="no chromium here")
_SCRIPT = """
const decoded = (text) => new Float64Array(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
const coded = (numbers) => {
  const bytes = new Uint8Array(Float64Array.from(numbers).buffer);
  return { coded: btoa(Array.from(bytes, (each) => String.fromCharCode(each)).join("")) };
};
const restored = (x) => {
  if (x === null || typeof x !== "object") return x;
  if ("coded" in x) return decoded(x.coded);
  if (Array.isArray(x)) return x.map(restored);
  return Object.fromEntries(Object.entries(x).map(([name, each]) => [name, restored(each)]));
};
// the arrays and places of states, outputs and inputs by name
const placesOf = (m, names) => names.map((name) => {
  const letter = ["x", "y", "u"].find((each) => m.about[each].includes(name));
  return [m[letter], m.about[letter].indexOf(name)];
});
const models = %s;
const given = restored(%s);
const answer = JSON.stringify((() => { %s })());
"""


def _coded(x):
    if isinstance(x, np.ndarray):
        return {"coded": base64.b64encode(np.ascontiguousarray(x, float).tobytes()).decode()}
    raise TypeError(x)


def _decoded(x):
    return np.frombuffer(base64.b64decode(x["coded"])) if "coded" in x else x


def _whole(models, script, given):
    texts = {name: of if isinstance(of, str) else model_text(of) for name, of in models.items()}
    return _SCRIPT % (program(texts), json.dumps(given, default=_coded), script)


def in_node(models, script, given=None):
    """What a script returns in node; `models` are classes or texts by name."""
    whole = _whole(models, script, given) + "console.log(answer);"
    run = subprocess.run([NODE, "-"], input=whole, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr[-2000:]
    return json.loads(run.stdout, object_hook=_decoded)


def in_chromium(models, script, given=None):
    """What a script returns in a page of Chromium."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        file = Path(name) / "empty.html"
        file.write_text("<!DOCTYPE html><title>job</title>", "utf-8")
        with Page(file, Path(name) / "browser") as page:
            answer = page.evaluate(f"(() => {{ {_whole(models, script, given)} return answer; }})()")
            return json.loads(answer, object_hook=_decoded)


HOSTS = {"node": in_node, "chromium": in_chromium}


def profile_numbers(signal):
    """A number or a `Profile` as ``run`` takes it."""
    changes = getattr(signal, "changes", ())
    return np.array([getattr(signal, "start", signal), *(x for change in changes for x in change)], float)
