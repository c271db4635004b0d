"use strict";
(() => {
  const byId = (name) => document.getElementById(name);
  const root = byId("live-root");
  if (!root) return;
  const said = (text) => (byId("live-said").textContent = text);
  const none = byId("live-none");
  let model;
  try {
    model = liveModel(unpackedData("live-data"), liveEquations);
  } catch (error) {
    none.textContent = `The live machine does not run here (${error.message}); all else on this page is there.`;
    return;
  }
  none.hidden = true;
  root.hidden = false;
  const { data, quantities, study, shown } = model;
  const values = study.slice();
  let markPlot = null;
  let released = () => {}; // after the last move of a slider

  const make = (parent, tag, attributes = {}, text) => {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    if (text !== undefined) element.textContent = text;
    parent.appendChild(element);
    return element;
  };

  /* plots: curves over one axis, with those of the study behind them */
  const nice = (low, high, most) => {
    const raw = (high - low) / most || 1, power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 2.5, 5, 10].map((m) => m * power).find((s) => s >= raw * 0.999);
    const ticks = [];
    for (let t = Math.ceil(low / step - 1e-9) * step; t <= high + 1e-9 * step; t += step) ticks.push(Math.abs(t) < 1e-9 * step ? 0 : t);
    return ticks;
  };
  const short = (x) => (x !== 0 && (Math.abs(x) < 1e-3 || Math.abs(x) >= 1e6) ? model.digits(x, 2).replace(".0", "").replace(/\u00a0/g, "") : String(Number(x.toPrecision(4))).replace("-", "−"));
  // a further round of the colours is dashed
  const dashed = (look) => look >= COLOURS.length;
  const colour = (curve, n) => (curve.behind ? "#999" : COLOURS[(curve.look ?? n) % COLOURS.length]);
  const COLOURS = ["#0b6fa4", "#c1440e", "#3d3d3d", "#6a994e", "#7a4fa3", "#b08900", "#00857c", "#a23b72", "#666666", "#4a6fe3"];

  class Plot {
    constructor(parent, title, xUnit, xTicks) {
      this.xUnit = xUnit;
      this.xTicks = xTicks;
      const box = make(parent, "figure", { class: "live-plot" });
      make(box, "figcaption", {}, title);
      this.svg = drawn(box, "svg", { viewBox: "0 0 560 230", role: "img", "aria-label": title });
      this.legend = make(box, "p", { class: "live-legend" });
      this.mark = null;
    }

    // curves: { title, x, y, behind }; x and y are numbers as shown
    show(curves, unit) {
      const [left, right, top, bottom] = [62, 548, 10, 192];
      const ends = (list) => list.reduce(([a, b], x) => [Math.min(a, x), Math.max(b, x)], [Infinity, -Infinity]);
      const [x0, x1] = ends(curves.flatMap((c) => ends(c.x)));
      let [y0, y1] = ends([0, ...curves.flatMap((c) => ends(c.y))]);
      if (!(y1 > y0)) y1 = y0 + 1;
      const pad = 0.05 * (y1 - y0);
      [y0, y1] = [y0 < 0 ? y0 - pad : 0, y1 + pad];
      const px = (x) => left + ((x - x0) / (x1 - x0 || 1)) * (right - left), py = (y) => bottom - ((y - y0) / (y1 - y0)) * (bottom - top);
      this.px = px;
      this.xOf = (p) => x0 + ((p - left) / (right - left)) * (x1 - x0);
      this.svg.replaceChildren();
      for (const y of nice(y0, y1, 5)) {
        drawn(this.svg, "path", { class: "grid", d: `M${left} ${py(y)} H${right}` });
        drawn(this.svg, "text", { x: left - 6, y: py(y) + 4, "text-anchor": "end" }, short(y));
      }
      for (const x of this.xTicks ? this.xTicks(x0, x1) : nice(x0, x1, 7)) {
        drawn(this.svg, "path", { class: "grid", d: `M${px(x)} ${top} V${bottom}` });
        drawn(this.svg, "text", { x: px(x), y: bottom + 17, "text-anchor": "middle" }, short(x));
      }
      drawn(this.svg, "text", { x: right, y: bottom + 34, "text-anchor": "end" }, this.xUnit);
      drawn(this.svg, "text", { x: left - 50, y: bottom + 34 }, unit ? `in ${unit}` : "");
      curves.forEach((curve, n) => {
        // the largest and the least of each piece that is a pixel wide
        const size = curve.x.length, every = Math.max(1, Math.floor(size / 480)), points = [];
        const add = (k) => points.push(`${Math.round(10 * px(curve.x[k])) / 10} ${Math.round(10 * py(curve.y[k])) / 10}`);
        for (let k = 0; k < size; k += every) {
          if (every < 4) add(k);
          else {
            let low = k, high = k;
            for (let j = k + 1; j < Math.min(k + every, size); j++) {
              if (curve.y[j] < curve.y[low]) low = j;
              if (curve.y[j] > curve.y[high]) high = j;
            }
            [low, high].sort((a, b) => a - b).forEach(add);
          }
        }
        add(size - 1);
        drawn(this.svg, "path", { class: curve.behind ? "curve behind" : "curve", d: "M" + points.join("L"), stroke: colour(curve, n), "stroke-dasharray": dashed(curve.look ?? n) ? "7 5" : "none" });
      });
      this.legend.replaceChildren();
      const named = curves.filter((c) => c.title);
      named.forEach((curve) => {
        const item = make(this.legend, "span");
        const look = curve.look ?? curves.indexOf(curve), of = colour(curve, look);
        make(item, "i", { style: `background:${dashed(look) ? `linear-gradient(90deg, ${of} 40%, #fff 40% 60%, ${of} 60%)` : of}` });
        item.append(curve.title);
      });
      if (this.mark) this.drawMark();
    }

    // a mark across the plot that a pointer drags
    drag(title, get, moved, dropped) {
      this.mark = { title, get };
      const at = (event) => this.xOf(((event.clientX - this.svg.getBoundingClientRect().left) / this.svg.getBoundingClientRect().width) * 560);
      this.svg.style.touchAction = "pan-y";
      let before = null;
      this.svg.addEventListener("pointerdown", (event) => {
        before = get();
        if (before === null || event.button !== 0) return;
        this.svg.setPointerCapture(event.pointerId);
        this.dragged = true;
        moved(at(event));
      });
      // a finger that scrolls the page takes the pointer away
      this.svg.addEventListener("pointercancel", () => {
        if (this.dragged) moved(before);
        this.dragged = false;
      });
      this.svg.addEventListener("pointermove", (event) => this.dragged && moved(at(event)));
      this.svg.addEventListener("pointerup", (event) => {
        if (!this.dragged) return;
        this.dragged = false;
        moved(at(event));
        dropped();
      });
    }

    drawMark() {
      this.svg.querySelector(".mark")?.remove();
      const x = this.mark.get();
      if (x === null) return;
      const group = drawn(this.svg, "g", { class: "mark" });
      drawn(group, "path", { d: `M${this.px(x)} 10 V192` });
      drawn(group, "path", { class: "grip", d: `M${this.px(x)} 10 l-7 -10 h14 z` });
      drawn(group, "title", {}, this.mark.title);
    }
  }

  /* controls */
  const within = (q, x) => Math.min(q.high ?? Infinity, Math.max(q.low ?? -Infinity, x));
  const BY_UNIT = { m: 0.2, kg: 10, N: 1000, "N m": 100, s: 1, rad: 0.5, "°": 0.5 };
  const isAngle = (q) => q.name === "crank_angle";
  const sliderEnds = (i) => {
    const q = quantities[i], x = study[i];
    if (isAngle(q)) return [0, 2 * Math.PI];
    if (q.group === "feed") return [within(q, Math.min(0, x)), within(q, loadEnd(i))];
    const usual = (BY_UNIT[q.unit] ?? 1 / q.factor);
    if (q.role === "event") return [within(q, Math.min(0, 3 * x)), within(q, x > 0 ? 3 * x : x < 0 ? 0 : usual)];
    if (x === 0) return [within(q, q.low !== null && q.low >= 0 ? 0 : -usual), within(q, usual)];
    return x > 0 ? [within(q, 0.4 * x), within(q, 2 * x)] : [within(q, 2 * x), within(q, 0.4 * x)];
  };
  // a load at which the effort is several times that of the study
  const loadEnd = (i) => {
    const base = model.reductions.peak(model.turn(study, 36).columns.crank_torque), other = study.slice();
    other[i] = Math.abs(study[i]) || 1;
    for (let k = 0; k < 30; k++) {
      other[i] *= 1.5;
      try {
        if (model.reductions.peak(model.turn(other, 36).columns.crank_torque) > 6 * base) break;
      } catch (error) {
        if (!(error instanceof model.Refusal)) throw error;
        break;
      }
    }
    const power = 10 ** Math.floor(Math.log10(other[i]));
    return [1, 2, 3, 5, 10].map((m) => m * power).find((x) => x >= other[i]);
  };
  const rows = new Map();
  const STEPS = 400;
  const place = (row, x) => Math.round((STEPS * (x - row.low)) / (row.high - row.low || 1));
  const inputText = (q, x) => String(Number((q.factor * x + q.offset).toPrecision(7)));

  const control = (parent, i) => {
    const q = quantities[i], id = `live-q-${i}`, [low, high] = sliderEnds(i);
    const box = make(parent, "div", { class: "live-q" });
    const unit = q.unit ? ` in ${q.unit}` : "";
    make(box, "label", { for: id, title: q.key.join(".") }, q.title);
    const track = make(box, "span", { class: "live-track" });
    const range = make(track, "input", { type: "range", id, min: 0, max: STEPS, step: 1, "data-q": i });
    const tick = make(track, "span", { class: "live-tick", "aria-hidden": "true" }, "▾");
    const field = make(box, "input", { type: "number", step: "any", "aria-label": `${q.title}${unit}`, "data-q": i, id: `${id}-number` });
    make(box, "span", { class: "u" }, q.unit);
    const row = { i, low, high, range, field, tick, box };
    rows.set(i, row);
    range.addEventListener("input", () => set(i, row.low + ((row.high - row.low) * Number(range.value)) / STEPS));
    range.addEventListener("change", () => released());
    field.addEventListener("change", () => {
      const x = (Number(field.value) - q.offset) / q.factor;
      if (field.value === "" || !Number.isFinite(x)) return refresh(row);
      // the number of the file in its shown digits is that of the file
      set(i, inputText(q, x) === inputText(q, study[i]) ? study[i] : x);
      released();
    });
    refresh(row);
    return row;
  };
  const refresh = (row) => {
    const q = quantities[row.i], x = values[row.i];
    if (x < row.low) row.low = x;
    if (x > row.high) row.high = x;
    row.range.value = place(row, x);
    row.range.setAttribute("aria-valuetext", shown(x, q));
    if (document.activeElement !== row.field || Number(row.field.value) !== Number(inputText(q, x))) row.field.value = inputText(q, x);
    row.tick.style.left = `calc(8px + (100% - 16px) * ${(study[row.i] - row.low) / (row.high - row.low || 1)})`;
    row.box.classList.toggle("changed", x !== study[row.i]);
  };

  const set = (i, x) => {
    values[i] = x;
    const row = rows.get(i);
    if (row) refresh(row);
    changed = i;
    if (!waiting) requestAnimationFrame(frame);
    waiting = true;
  };
  let waiting = false, changed = null, culprit = null, good = study.slice();
  const frame = () => {
    waiting = false;
    update();
  };

  /* groups of controls: those with the largest effect are open */
  const controls = byId("live-controls");
  const group = (title, list, most) => {
    if (!list.length) return;
    const set_ = make(controls, "fieldset");
    make(set_, "legend", {}, title);
    list.slice(0, most).forEach((i) => control(set_, i));
    if (list.length > most) {
      const more = make(set_, "details");
      make(more, "summary", {}, `${list.length - most} more`);
      list.slice(most).forEach((i) => control(more, i));
    }
  };
  const effects = model.effects(study);
  const byEffect = (list) => list.filter((i) => effects[i] > 1e-9).sort((a, b) => effects[b] - effects[a]);
  const of = (test) => quantities.map((_, i) => i).filter((i) => test(quantities[i]));
  group("Load", of((q) => q.group === "feed"), 6);
  const drive = of((q) => q.group === "drive");
  group("Drive", [...drive.filter((i) => quantities[i].key[0] !== "motor"), ...drive.filter((i) => quantities[i].key[0] === "motor")], Math.max(1, drive.filter((i) => quantities[i].key[0] !== "motor").length));
  group("Machine", byEffect(of((q) => q.group === "machine")), 8);

  /* the machine over a turn */
  const stage = byId("live-stage"), PICTURES = 120;
  const sketch = data.turn.picture;
  const motion = { ...sketch, groups: [], paths: [], rails: [], runs: [] };
  let clip = null, at = 0;
  const picture = machinePicture(stage, motion, {
    values: byId("live-readings"), kept: 0, forces: byId("live-forces"), factor: () => 1, caption: () => "",
  });
  const sampled = (turn, name) => {
    const column = turn.columns[name], last = data.turn.turns ? turn.count : turn.count - 1;
    return Array.from({ length: PICTURES + 1 }, (_, k) => column[Math.round((k * last) / PICTURES) % turn.count]);
  };
  const clipOf = (turn) => {
    const joints = {}, blocks = {};
    for (const name of sketch.joints) joints[name] = { x: sampled(turn, `x(${name})`), y: sampled(turn, `y(${name})`) };
    for (const [name, column] of Object.entries(sketch.blocks)) blocks[name] = sampled(turn, column).map((x) => (x * 180) / Math.PI);
    const forces = data.turn.forces.filter((f) => f.at in joints).map((f) => ({ ...f, group: "", kind: "reaction", x: sampled(turn, `${f.of}.fx`), y: sampled(turn, `${f.of}.fy`) }));
    const largest = Math.max(0, ...forces.map((f) => Math.max(...f.x.map((x, k) => Math.hypot(x, f.y[k])))));
    motion.paths = Object.entries(sketch.paths).filter(([, name]) => name in joints).map(([title, name]) => ({ title, ...joints[name] }));
    motion.rails = sketch.rails.filter((name) => name in joints && name in blocks).map((name) => {
      const { x, y } = joints[name], angle = (blocks[name][0] * Math.PI) / 180, [dx, dy] = [Math.cos(angle), Math.sin(angle)];
      const s = x.map((each, k) => each * dx + y[k] * dy), low = s.indexOf(Math.min(...s)), high = s.indexOf(Math.max(...s)), room = 0.25 * (s[high] - s[low]) + 1e-9;
      return [x[low] - dx * room, y[low] - dy * room, x[high] + dx * room, y[high] + dy * room];
    });
    const run = { name: "turn", title: "", event: false, time: [0], joints, readings: [], blocks, loads: {}, largest, forces };
    motion.runs = [run];
    return run;
  };
  const shownPlace = () => {
    const [low, high] = data.turn.span;
    byId("live-place-shown").textContent = shown(low + ((high - low) * at) / PICTURES, data.turn.place);
  };
  const pose = (k) => {
    at = k;
    picture.draw(at);
    shownPlace();
  };

  /* results */
  const tableOf = (id, head, list) => {
    const table = byId(id);
    table.replaceChildren();
    const row = make(make(table, "thead"), "tr");
    head.forEach((text) => make(row, "th", { scope: "col" }, text));
    const body = make(table, "tbody");
    return list.map((each) => {
      const line = make(body, "tr");
      make(line, "th", { scope: "row" }, each.title);
      return [make(line, "td", { "data-result": each.name }), make(line, "td", { class: "base" }), make(line, "td")];
    });
  };
  const whole = data.runs || data.without_runs ? "study" : "file";
  const ofWhole = `the ${whole}'s${data.organs ? ` machine with ${data.organs}` : ""}`;
  for (const each of document.querySelectorAll(".live-whole")) each.textContent = whole;
  if (!data.turn.turns) byId("live-turn-title").textContent = `Over the way of the ${data.turn.driver}, forth at constant speed`;
  const ofTurn = data.turn.results.filter((r) => !r.group), ofPins = data.turn.results.filter((r) => r.group);
  const cells = tableOf("live-results", ["", "now", ofWhole, "change"], ofTurn);
  const pinCells = tableOf("live-pins", ["largest force in a pin", "now", ofWhole, "change"], ofPins);
  const fill = (list, into, now, before) =>
    list.forEach((r, n) => {
      const [cell, base, change] = into[n], x = now[r.name], y = before[r.name];
      cell.textContent = x === null || x === undefined ? "none" : shown(x, r);
      cell.dataset.value = x ?? "";
      base.textContent = y === null || y === undefined ? "none" : shown(y, r);
      const share = x !== null && y ? (100 * (x - y)) / Math.abs(y) : 0;
      change.textContent = Math.abs(share) < 0.05 || !Number.isFinite(share) ? "" : `${share > 0 ? "+" : "−"}${model.digits(Math.abs(share), 2)} %`;
    });
  const baseTurn = model.turn(study), base = model.results(baseTurn);
  const placeUnit = data.turn.place;
  // one of so many values as shown, and of a turn its `end`: the begin of the next one
  const thinned = (count, column, by, offset, end) => {
    const list = Array.from({ length: Math.ceil(column.length / count) }, (_, k) => by * column[count * k] + offset);
    return data.turn.turns ? [...list, end ?? list[0]] : list;
  };
  const angleTicks = (low, high) => (high - low > 350 ? [0, 45, 90, 135, 180, 225, 270, 315, 360] : nice(low, high, 7));
  const turnPlots = data.turn.curves.map((c) => new Plot(byId("live-turn-plots"), c.title, `${data.turn.driver} ${data.turn.effort === "force" ? "place" : "angle"} in ${placeUnit.unit}`, placeUnit.unit === "°" ? angleTicks : null));
  const curvesOf = (c, turn, behind) => {
    const list = c.curves === "forces" ? ofPins.map((r) => ({ title: r.title, of: r.of, by: "" })) : c.curves;
    const count = list.length > 2 ? 3 : 1;
    const x = thinned(count, turn.place, placeUnit.factor, placeUnit.offset, 2 * Math.PI * placeUnit.factor);
    return list.map((each, look) => {
      const y = thinned(count, turn.columns[each.of], c.factor * model.factorOf(each.by, turn), c.offset);
      return { title: behind ? "" : each.title, look, x, y, behind };
    });
  };
  const showTurn = (turn, isStudy) => {
    const now = model.results(turn);
    fill(ofTurn, cells, now, base);
    fill(ofPins, pinCells, now, base);
    data.turn.curves.forEach((c, n) => turnPlots[n].show([...(isStudy || c.curves === "forces" ? [] : curvesOf(c, baseTurn, true)), ...curvesOf(c, turn, false)], c.unit));
    clip = clipOf(turn);
    picture.choose(clip);
    pose(at);
    const list = byId("live-verdicts"), box = byId("live-model"), judged = isStudy && data.verdict;
    list.replaceChildren();
    box.hidden = !judged;
    if (judged) {
      // the study has judged more than a turn can show
      const [sign, css] = { true: ["✓", "good"], "in part": ["◐", "partly"], false: ["✗", "bad"] }[judged.holds];
      box.textContent = `${sign} ${judged.text}`;
      box.className = `judged ${css}`;
      return;
    }
    for (const rod of ["web", "wall"]) {
      const found = model.pulls(turn).filter((p) => p.title.endsWith(rod)), worst = found.find((p) => p.value < 0);
      if (!worst) continue;
      const item = make(list, "li");
      make(item, "span", { class: "sign", "aria-hidden": "true" }, "!");
      make(item, "span", { class: "said" }, `${worst.title} ${model.digits(worst.value)} N: ${worst.words}.`);
    }
  };

  const update = () => {
    const began = performance.now();
    let turn = null, why = "";
    try {
      turn = model.turn(values);
    } catch (error) {
      if (!(error instanceof model.Refusal)) throw error;
      // a value out of its bounds is the one to mend, or the first that was refused
      const beyond = values.findIndex((x, i) => !model.admits(quantities[i], x));
      if (beyond >= 0) culprit = beyond;
      else if (culprit === null || values[culprit] === good[culprit]) culprit = values[changed] === good[changed] ? values.findIndex((x, i) => x !== good[i]) : changed;
      why = model.explained(error, values, culprit);
    }
    if (turn) culprit = null;
    for (const row of rows.values()) {
      row.box.classList.toggle("refused", row.i === culprit);
      row.field.setAttribute("aria-invalid", row.i === culprit);
    }
    if (why) {
      said(`${why} The results below are those of the last machine that works.`);
      root.dataset.refused = why;
      return;
    }
    delete root.dataset.refused;
    const same = values.every((x, i) => x === study[i]);
    said(same ? "" : `${values.filter((x, i) => x !== study[i]).length} numbers differ from the ${whole}'s.`.replace(/^1 numbers differ/, "1 number differs"));
    good = values.slice();
    showTurn(turn, same);
    if (markPlot) markPlot.drawMark();
    root.dataset.frame = (performance.now() - began).toFixed(2);
  };

  /* runs */
  const NO_RUNS = data.without_runs;
  if (NO_RUNS) {
    byId("live-without-runs").hidden = false;
    byId("live-without-runs").textContent = `There are no start-up and overloads here: ${NO_RUNS}.`;
  }
  if (data.runs) {
    byId("live-runs").hidden = false;
    const events = data.runs.events, select = byId("live-event");
    const STEADY_KEYS = (q) => q.role !== "event";
    events.forEach((event, n) => select.add(new Option(event.title, n)));
    if (!events.length) select.parentElement.hidden = true;
    const jam = events.findIndex((event) => "force" in event.values);
    if (jam >= 0) select.value = jam;
    const measures = [...data.runs.results, ...(data.runs.trip === null ? [] : [{ name: "coupling_trip_time", title: "coupling opens after", unit: "s", factor: 1, offset: 0 }])];
    const measureCells = tableOf("live-measures", [events.length ? "from the begin of the event on" : "in steady running", "now", "the study's", "change"], measures);
    const unit = Object.fromEntries(data.runs.results.map((r) => [r.name, r]));
    const SERIES = [
      ["speed", unit.speed_least, `Speed of the ${data.turn.driver}`],
      ["torque", unit.crank_torque_peak, `Torque at the ${data.turn.driver}`],
      ["current", unit.current_peak, "Current of the motor"],
    ];
    const runPlots = SERIES.map(([, , title]) => new Plot(byId("live-run-plots"), title, "time in s"));
    const startPlot = new Plot(byId("live-run-plots"), `Start-up: speed of the ${data.turn.driver}`, "time in s");
    const anglePlot = new Plot(byId("live-run-plots"), `Peak torque over the ${data.turn.driver} angle of the event`, "angle in °", angleTicks);
    anglePlot.svg.parentElement.hidden = true;
    const eventNow = () => events[Number(select.value)] ?? null;
    const eventBox = byId("live-event-controls");
    const angleAt = () => quantities.findIndex((q) => isAngle(q) && q.event === eventNow()?.name);
    const buildEvent = () => {
      for (const [i, row] of [...rows]) if (quantities[i].role === "event") rows.delete(i), row.box.remove();
      const event = eventNow();
      of((q) => q.role === "event" && q.event === event?.name).forEach((i) => control(eventBox, i));
      byId("live-angles").hidden = !event || event.from_rest || angleAt() < 0;
    };
    buildEvent();
    markPlot = turnPlots[0];
    if (data.turn.turns)
      markPlot.drag(
        "the angle at which the event begins",
        () => (angleAt() < 0 ? null : (((values[angleAt()] * 180) / Math.PI) % 360 + 360) % 360),
        (x) => angleAt() >= 0 && set(angleAt(), (Math.min(360, Math.max(0, x)) * Math.PI) / 180),
        () => released(),
      );

    let kept = null;
    // steady running with these values: from that of nearly the same ones, or from rest
    const steadyOf = (chosen) => {
      const key = quantities.map((q, i) => (STEADY_KEYS(q) ? chosen[i] : 0)), runs = model.runsOf(chosen);
      if (kept && key.every((x, i) => x === kept.key[i])) {
        runs.states = kept.states;
        return { ...kept, runs };
      }
      const start = runs.cut(runs.start());
      const steady = start.made < start.wanted ? null : runs.settle();
      return (kept = { key, runs, start, steady, states: runs.states });
    };
    const outcome = (chosen, event) => {
      try {
        return followed(chosen, event);
      } catch (error) {
        if (!(error instanceof model.Refusal)) throw error;
        return { ...kept, start: null, steady: null, run: null, measures: null, refused: `${error.message}.` };
      }
    };
    const followed = (chosen, event) => {
      const found = steadyOf(chosen), { runs } = found;
      if (event?.from_rest) {
        const run = runs.cut(runs.start(event));
        return { ...found, run, measures: runs.measures(run) };
      }
      const opened = [found.start, found.steady && runs.cut(found.steady)].some((each) => each?.tripped !== undefined);
      if (!found.steady || opened) return { ...found, run: null, measures: null, opened };
      runs.states = found.states;
      const run = event ? runs.event(event, found.steady) : found.steady;
      return { ...found, run, measures: runs.measures(run) };
    };
    const studies = new Map();
    const ofStudy = (event) => {
      const name = event?.name ?? "";
      if (!studies.has(name)) {
        const before = kept;
        kept = studies.get(" steady") ?? null;
        studies.set(name, outcome(study, event));
        studies.set(" steady", kept);
        kept = before;
      }
      return studies.get(name);
    };
    const judge = (found) => {
      const box = byId("live-judged"), w = model.speedOf(good), event = eventNow();
      let text = !event ? "The motor drives the machine." : event.from_rest ? "The motor starts with it." : "The motor runs through it.", mark = "good";
      const steady = found.steady ? found.runs.crank(found.steady).speed : null;
      const mean = steady ? steady.reduce((a, b) => a + b, 0) / steady.length : w;
      if (found.refused) [text, mark] = [found.refused, "partly"];
      else if (found.opened) [text, mark] = ["The torque limiter opens before the event: in the start, or in steady running.", "bad"];
      else if (!found.run) [text, mark] = ["The motor does not come to steady running with this load: it stalls, falls far behind, or turns ever slower or faster.", "bad"];
      else if (found.run.tripped !== undefined) [text, mark] = [`The torque limiter opens ${model.digits(found.run.tripped)} s after the begin.`, "partly"];
      else if (found.measures.stall_time !== null) [text, mark] = [`The ${data.runs.slips ? data.turn.driver + " stands" : "motor stalls"} ${model.digits(found.measures.stall_time)} s after the begin.`, "bad"];
      else if (mean < (1 - data.runs.speed_deviation) * w && data.runs.reference) [text, mark] = [`The motor does not reach the speed that is asked for: it turns the ${data.turn.driver} at ${shown(mean, unit.speed_least)}.`, "bad"];
      else if (event && !event.from_rest && found.measures.speed_least < 0.1 * w) [text, mark] = [`The ${data.turn.driver} is held up, and the motor turns it on again.`, "partly"];
      box.textContent = text;
      box.className = `judged ${mark}`;
    };
    const show = () => {
      const began = performance.now();
      const event = eventNow(), found = outcome(good, event), time = performance.now() - began, before = ofStudy(event);
      root.dataset.transient = time.toFixed(1);
      judge(found);
      fill(measures, measureCells, found.measures ?? {}, before.measures ?? {});
      // a part of the outcome, "run" or "start": that of the study behind that of now
      const plotted = (plot, part, name, r) => {
        const curves = [before, found].filter((f) => f[part]).map((f) => ({
          title: "", behind: f === before && found !== before, look: 0, x: f[part].time,
          y: Array.from(f.runs.crank(f[part])[name], (x) => r.factor * x + r.offset),
        }));
        plot.svg.parentElement.hidden = !curves.length;
        if (curves.length) plot.show(curves, r.unit);
      };
      SERIES.forEach(([name, r], n) => plotted(runPlots[n], "run", name, r));
      plotted(startPlot, "start", "speed", unit.speed_least);
      root.dataset.runs = String(Number(root.dataset.runs ?? 0) + 1);
    };
    let token = 0;
    released = () => {
      if (waiting) requestAnimationFrame(() => released());
      else if (!root.dataset.refused) show();
      anglePlot.svg.parentElement.hidden = true;
      token++;
    };
    select.addEventListener("change", () => {
      buildEvent();
      if (markPlot) markPlot.drawMark();
      released();
    });
    byId("live-angles").addEventListener("click", async () => {
      const own = ++token, i = angleAt(), event = eventNow(), x = [], y = [];
      const r = unit.crank_torque_peak;
      for (let k = 0; k <= 36; k++) {
        const other = good.slice();
        other[i] = (k * Math.PI) / 18;
        const found = outcome(other, event);
        if (!found.run) break;
        x.push(10 * k);
        y.push(r.factor * found.measures.crank_torque_peak);
        if (k) {
          anglePlot.svg.parentElement.hidden = false;
          anglePlot.show([{ title: "", x, y, look: 1 }], r.unit);
        }
        await new Promise((go) => setTimeout(go));
        if (own !== token) return;
      }
      if (!y.length) return said("The motor does not come to the event, whose angles are not compared.");
      const worst = y.indexOf(Math.max(...y));
      anglePlot.legend.textContent = `Worst at ${x[worst]}°: ${model.digits(y[worst])} ${r.unit}.`;
      root.dataset.worst = x[worst];
    });
    setTimeout(show);
  }

  byId("live-place").addEventListener("input", (event) => pose(Number(event.target.value)));
  let playing = false, last = null, phase = 0;
  const advance = (now) => {
    if (!playing) return;
    const turnTime = Math.min(8, Math.max(1.5, (2 * Math.PI) / (data.turn.turns ? model.speedOf(good) : 2)));
    if (last !== null) phase += (PICTURES * Math.min(now - last, 250)) / 1000 / turnTime;
    last = now;
    const swing = phase % (2 * PICTURES), k = data.turn.turns ? Math.floor(phase) % PICTURES : Math.floor(swing <= PICTURES ? swing : 2 * PICTURES - swing);
    byId("live-place").value = k;
    pose(k);
    requestAnimationFrame(advance);
  };
  byId("live-play").addEventListener("click", () => {
    playing = !playing;
    [last, phase] = [null, at];
    byId("live-play").textContent = playing ? "❚❚ Pause" : "▶ Play";
    byId("live-play").setAttribute("aria-label", playing ? "Pause" : "Play");
    if (playing) requestAnimationFrame(advance);
  });

  /* back, and the study file */
  byId("live-back").addEventListener("click", () => {
    study.forEach((x, i) => (values[i] = x));
    changed = null;
    for (const row of rows.values()) refresh(row);
    byId("live-file").hidden = true;
    update();
    released();
  });
  const copy = byId("live-copy");
  if (!data.file) copy.hidden = true;
  copy.addEventListener("click", async () => {
    const text = model.studyFile(good), box = byId("live-toml");
    byId("live-file").hidden = false;
    box.value = text;
    try {
      await navigator.clipboard.writeText(text);
      said("The study file is copied; chainunit study takes it.");
    } catch {
      box.select();
      said("The study file stands below; chainunit study takes it.");
    }
  });
  byId("live-controls").addEventListener("submit", (event) => event.preventDefault());
  at = Number(byId("live-place").value);
  update();
})();
