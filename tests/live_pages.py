"""The live machine of a page in node: its equations and its runs without a page."""

from __future__ import annotations

import json
import subprocess
from importlib.resources import files

from javascript_hosts import NODE

from chainunit.report.live.page import live_of_config
from chainunit.study.choice import choose

_SCRIPT = """
%s
(() => {
  const model = liveModel(%s, %s);
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
    whole = _SCRIPT % (code, json.dumps(live.data), live.equations, script)
    run = subprocess.run([NODE, "-"], input=whole, capture_output=True, text=True, check=False)
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
