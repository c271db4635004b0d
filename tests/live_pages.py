"""The live machine of a page in node: its equations and its runs without a page."""

from __future__ import annotations

import base64
import json
import subprocess
from importlib.resources import files

from wasm_hosts import NODE

from chainunit.report.live.page import live_of_config
from chainunit.study.choice import choose

_SCRIPT = """
const fs = require("fs");
const given = JSON.parse(fs.readFileSync(0, "utf8"));
const bytes = {};
for (const [name, text] of Object.entries(given.modules)) bytes[name] = Buffer.from(text, "base64");
%s
(async () => {
  const model = await liveModel(given.data, bytes);
  // values by the keys of a study file, "feed.left.material_mass"
  const values = (changed) => {
    const list = model.study.slice();
    for (const [key, x] of Object.entries(changed)) {
      const i = model.quantities.findIndex((q) => q.key.join(".") === key);
      if (i < 0) throw new Error(`no quantity ${key}`);
      list[i] = x;
    }
    return list;
  };
  const answer = (() => { %s })();
  console.log(JSON.stringify(answer, (_, x) => (x === undefined ? null : x)));
})();
"""


def in_node(live, script):
    """The value that a script returns, which has `model` and ``values``, a function of changes by key."""
    code = (files("chainunit.report.live") / "model.js").read_text("utf-8")
    modules = {name: base64.b64encode(content).decode() for name, content in live.modules.items()}
    job = json.dumps({"data": live.data, "modules": modules})
    run = subprocess.run(
        [NODE, "-e", _SCRIPT % (code, script)], input=job, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr[-2000:]
    return json.loads(run.stdout)


def live_of(config, folder):
    """The live machine of a study, and the choice of its drive."""
    return live_of_config(config, folder), choose(config, folder)


OUTCOME = """
const outcome = (changed, name) => {
  const runs = model.runsOf(values(changed)), event = model.data.runs.events.find((each) => each.name === name);
  if (event.from_rest) return runs.measures(runs.cut(runs.start(event)));
  const start = runs.start(), steady = start.made < start.wanted ? null : runs.settle();
  return steady && runs.measures(runs.event(event, steady));
};
"""
"""A function of a script: the measures of an event with changed values; None where the motor does not settle."""
