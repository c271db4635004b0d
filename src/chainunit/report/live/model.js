"use strict";
/* The machine and the drive of a live page, without a page: everything is computed from the values of the quantities,
   in SI units, by their places in `data.quantities`. `equations` are those of the turn and of the runs, see
   chainunit.core.printing.javascript. */
const liveModel = (data, equations) => {
  const TURN = 2 * Math.PI;
  const MOST_NUMBERS = 2 ** 24; // of a run, for which a browser has memory

  /* equations, with their numbers by name */
  const named = (of) => {
    const places = new Map();
    for (const letter of "yxup") of.about[letter].forEach((name, n) => places.set(name, [of[letter], n]));
    return {
      ...of,
      set(name, value) {
        const [array, n] = places.get(name);
        array[n] = value;
      },
      get(name) {
        const [array, n] = places.get(name);
        return array[n];
      },
      has: (name) => places.has(name),
    };
  };
  const turnKernel = named(equations.turn), runsKernel = data.runs ? named(equations.runs) : null;
  const quantities = data.quantities, study = quantities.map((q) => q.value);
  const placeOf = (role) => quantities.findIndex((q) => q.role === role);
  const speedAt = placeOf("speed"), ratioAt = placeOf("ratio");
  for (const [name, value] of Object.entries(data.turn.parameters)) turnKernel.set(name, value);
  const baseRatio = data.turn.parameters.ratio ?? 1;

  /* numbers as people read them */
  const raised = (n) => String(n).replace(/./g, (c) => "⁰¹²³⁴⁵⁶⁷⁸⁹⁻"["0123456789-".indexOf(c)]);
  const digits = (x, n = 3) => {
    if (x === 0) return "0";
    if (!Number.isFinite(x)) return x > 0 ? "∞" : x < 0 ? "−∞" : "-";
    const size = Math.abs(x);
    let text;
    if (size >= 1e6 || size < 1e-3) {
      const [mantissa, exponent] = x.toExponential(n - 1).split("e");
      text = `${mantissa}\u00a0×\u00a010${raised(Number(exponent))}`;
    } else text = size >= 10 ** (n - 1) ? x.toFixed(0) : x.toPrecision(n);
    return text.replace(/-/g, "−");
  };
  const shown = (x, of, n = 3) => {
    // a small power is in W
    if (of.unit === "kW" && Math.abs(x) < 100) return shown(x, { factor: 1, offset: 0, unit: "W" }, n);
    return shownIn(x, of, n);
  };
  const shownIn = (x, of, n) => `${digits(of.factor * x + of.offset, n)}${of.unit ? (of.unit === "°" ? "" : "\u00a0") + of.unit : ""}`;
  const general = (x) => String(Number(x.toPrecision(6))).replace("-", "−");

  /* refusals: the reason, and in words the range of the value that a rule names */
  class Refusal extends Error {
    constructor(reason, limits = "") {
      super(reason + limits);
      this.reason = reason;
    }
  }

  const admits = (q, x) => Number.isFinite(x) && (q.low === null || (q.above ? x > q.low : x >= q.low)) && (q.high === null || x <= q.high);
  const allowed = (q) =>
    [q.low === null ? "" : `${q.above ? ">" : "≥"} ${shown(q.low, q, 4)}`, q.high === null ? "" : `≤ ${shown(q.high, q, 4)}`].filter(Boolean).join(" and ") || "a number";

  // the first requirement that a machine does not meet; null where it meets all
  const unmet = (k) => {
    if (!k.requirements) return null;
    k.requirements();
    for (const [n, rule] of k.about.requirements.entries()) {
      const [value, low, high] = k.requirements_.subarray(3 * n);
      if (!(low < value && value < high)) return { rule, value, low, high };
    }
    return null;
  };
  const refused = ({ rule, value, low, high }) => {
    const unit = rule.unit === "1" ? "" : " " + rule.unit.replace(/\./g, " ");
    const given = rule.context.map((name) => `${name} = ${general(turnKernel.get(name))}`).join(", ");
    const limits = [Number.isFinite(low) ? `> ${general(low)}` : "", Number.isFinite(high) ? `< ${general(high)}` : ""].filter(Boolean).join(" and ");
    const found = Number.isFinite(value) ? ` = ${general(value)}${unit}` : "";
    return new Refusal(`${rule.subject}${found}: ${rule.why}${given ? ` with ${given}` : ""}`, `; ${low < high ? `must be ${limits}${unit}` : `no value fits; ${rule.remedy}`}`);
  };

  /* the machine over a turn */
  const ratioOf = (values) => (ratioAt < 0 ? baseRatio : values[ratioAt]);
  const speedOf = (values) => (speedAt < 0 ? data.turn.speed : values[speedAt]);
  const prepare = (values) => {
    quantities.forEach((q, i) => {
      if (!admits(q, values[i])) throw new Refusal(q.title, `: must be ${allowed(q)}`);
      for (const name of q.turn) turnKernel.set(name, values[i]);
    });
    if (turnKernel.has("ratio")) turnKernel.set("ratio", ratioOf(values));
    turnKernel.derive?.();
    const fault = unmet(turnKernel);
    if (fault) throw refused(fault);
  };
  const outputs = turnKernel.about.y;

  // the columns of a turn by name, each with a number for each place of the driver
  const turn = (values, count = data.turn.places) => {
    prepare(values);
    const ratio = ratioOf(values), speed = speedOf(values), [low, high] = data.turn.span;
    const columns = outputs.map(() => new Float64Array(count)), place = new Float64Array(count);
    turnKernel.set("w", speed * ratio);
    turnKernel.set("a", 0);
    for (let k = 0; k < count; k++) {
      place[k] = data.turn.turns ? (TURN * k) / count : low + ((high - low) * k) / (count - 1);
      turnKernel.set("phi", place[k] * ratio);
      turnKernel.values();
      for (let n = 0; n < columns.length; n++) columns[n][k] = turnKernel.y[n];
    }
    const found = { place, ratio, speed, count, columns: Object.fromEntries(outputs.map((name, n) => [name, columns[n]])) };
    if (!found.columns.crank_torque.every(Number.isFinite)) throw new Refusal("the linkage does not close all the way with these values");
    return found;
  };

  const means = (column) => {
    // of a whole turn the places are even; over a way the ends count half
    let sum = 0;
    column.forEach((x) => (sum += x));
    if (data.turn.turns) return sum / column.length;
    return (sum - 0.5 * (column[0] + column[column.length - 1])) / (column.length - 1);
  };
  const reductions = {
    peak: (c) => c.reduce((most, x) => Math.max(most, Math.abs(x)), 0),
    max: (c) => c.reduce((most, x) => Math.max(most, x), -Infinity),
    min: (c) => c.reduce((least, x) => Math.min(least, x), Infinity),
    // what is left of a mean by rounding is none
    mean: (c) => (Math.abs(means(c)) < 1e-12 * reductions.peak(c) ? 0 : means(c)),
    rms: (c) => Math.sqrt(means(c.map((x) => x * x))),
  };
  const factorOf = (by, at) => (by === "speed" ? at.speed : by === "ratio2" ? at.ratio * at.ratio : 1);
  const results = (at) => Object.fromEntries(data.turn.results.map((r) => [r.name, reductions[r.reduce](at.columns[r.of]) * factorOf(r.by, at)]));
  const pulls = (at) =>
    data.turn.pulls.map((each) => ({ ...each, value: Math.min(...each.columns.map((name) => reductions.min(at.columns[name]))) }));

  // the range of one value in which the machine works, about a value at which it does
  const range = (values, i) => {
    const works = (x) => {
      const other = values.slice();
      other[i] = x;
      try {
        return Boolean(turn(other, 36));
      } catch (error) {
        if (!(error instanceof Refusal)) throw error;
        return false;
      }
    };
    const inside = study[i];
    if (!works(inside)) return null;
    return [-1, 1].map((sense) => {
      let held = inside, out = null;
      for (let step = 0.02 * (Math.abs(inside) || 0.1), k = 0; k < 40 && out === null; k++, step *= 1.4) {
        if (works(held + sense * step)) held += sense * step;
        else out = held + sense * step;
      }
      if (out === null) return sense * Infinity;
      for (let k = 0; k < 24; k++) {
        const middle = 0.5 * (held + out);
        if (works(middle)) held = middle;
        else out = middle;
      }
      return held;
    });
  };

  // a refusal of values in words, with the range of the changed one
  const explained = (error, values, changed) => {
    const q = quantities[changed];
    if (!q || !admits(q, values[changed])) return `${error.message}.`;
    const limits = range(values, changed);
    if (!limits) return `${error.message}.`;
    // a limit beside a bound is that bound
    const near = 1e-6 * Math.abs(study[changed]);
    const sides = [
      Number.isFinite(limits[0]) && (q.low === null || limits[0] > q.low + near) ? `≥ ${shown(limits[0], q, 4)}` : "",
      Number.isFinite(limits[1]) && (q.high === null || limits[1] < q.high - near) ? `≤ ${shown(limits[1], q, 4)}` : "",
    ].filter(Boolean);
    return sides.length ? `${error.reason}. With the other values as they are, ${q.title} must be ${sides.join(" and ")}.` : `${error.message}.`;
  };
  // why values are refused; an empty text where they are not
  const refusal = (values, changed) => {
    try {
      turn(values);
      return "";
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      return explained(error, values, changed);
    }
  };

  // how much a tenth of each value changes the results, as a share of them
  const effects = (values) => {
    const base = results(turn(values, 90)), kept = data.turn.results.filter((r) => !r.group && base[r.name]);
    return quantities.map((q, i) => {
      if (!q.turn.length && q.role !== "speed" && q.role !== "ratio") return 0;
      const other = values.slice();
      other[i] += 0.1 * (Math.abs(values[i]) || 0.1);
      if (!admits(q, other[i])) other[i] = values[i] - 0.1 * Math.abs(values[i]);
      try {
        const changed = results(turn(other, 90));
        return Math.max(...kept.map((r) => Math.abs(changed[r.name] / base[r.name] - 1)));
      } catch (error) {
        if (!(error instanceof Refusal)) throw error;
        return 1;
      }
    });
  };

  /* runs of the drive */
  const evaluate = (formula, names) => {
    if (typeof formula === "number") return formula;
    if (typeof formula === "string") return names(formula);
    const [sign, a, b] = formula, [x, y] = [evaluate(a, names), evaluate(b, names)];
    return sign === "+" ? x + y : sign === "-" ? x - y : sign === "*" ? x * y : x / y;
  };

  // runs of which each goes on where the one before ends, as one
  const joined = (runs) => {
    const all = { made: 1 - runs.length, wanted: 1 - runs.length };
    for (const each of runs) for (const count of ["made", "wanted"]) all[count] += each[count];
    for (const name of Object.keys(runs[0]).filter((each) => !(each in all))) {
      all[name] = new Float64Array(all.made);
      let at = 0;
      runs.forEach((each, n) => {
        const rows = n ? each[name].subarray(1) : each[name];
        all[name].set(rows, at);
        at += rows.length;
      });
    }
    return all;
  };

  class Runs {
    constructor(values) {
      const of = data.runs, k = (this.k = runsKernel);
      this.values = values;
      this.of = of;
      this.spent = 0; // time in the runs so far
      this.ratio = ratioOf(values);
      this.speed = speedOf(values);
      this.turnTime = TURN / this.speed;
      // a droop lets the motor fall to the speed that is asked for
      this.referenceSpeed = this.speed * this.ratio + of.droop_speed;
      const role = (name, otherwise) => (placeOf(name) < 0 ? otherwise : values[placeOf(name)]);
      this.ramp = role("ramp", of.ramp);
      this.rampEnd = Math.max(this.ramp, of.starter_time);
      this.trip = role("trip", of.trip);
      this.release = role("release", 0);
      this.inputs = { ...of.inputs };
      for (const [name, value] of Object.entries(of.parameters)) k.set(name, value);
      quantities.forEach((q, i) => {
        for (const name of q.runs) {
          if (name in this.inputs) this.inputs[name] = values[i];
          else k.set(name, values[i]);
        }
      });
      if (ratioAt >= 0) k.set("machine.ratio", this.ratio);
      const rotor = placeOf("rotor"), added = placeOf("added");
      if (rotor >= 0 || added >= 0) {
        const own = rotor < 0 ? of.rotor.own : values[rotor];
        k.set(of.rotor.name, own + of.rotor.rest + (added < 0 ? of.rotor.added : values[added]));
      }
      if (of.derived) {
        prepare(values);
        k.k.set(turnKernel.k);
      } else k.derive?.();
      this.columns = [...new Set([...of.columns, of.names.angle, of.names.speed, of.names.motor_speed, of.names.current])].filter(k.has);
    }

    // signals in normal running, with a ramp from rest
    signals(changes = {}, fromRest = false, fedFrom = null) {
      const all = {};
      for (const [name, value] of Object.entries(this.inputs)) all[name] = { start: value, changes: [] };
      for (const q of quantities)
        if (q.group === "feed" && fromRest && this.of.empty_start)
          for (const name of q.runs)
            all[name] = { start: 0, changes: fedFrom === null ? [] : [[fedFrom, this.of.feed_rise * this.turnTime, this.inputs[name]]] };
      if (this.of.reference) {
        const w = this.referenceSpeed;
        all[this.of.reference] = fromRest ? { start: 0, changes: [[0, this.ramp, w]] } : { start: w, changes: [] };
      }
      if (fromRest) Object.assign(all, this.of.switching);
      return { ...all, ...changes };
    }

    // from the states in memory on: so many rows, a step apart
    run(begin, rows, signals, step = this.of.step) {
      const k = this.k, { x, y, about } = k, names = this.columns;
      this.spent += (rows - 1) * step;
      if (!(this.spent <= this.of.most && rows * names.length <= MOST_NUMBERS)) throw new Refusal(`these runs last too long for a page: ${shown(this.spent, { factor: 1, offset: 0, unit: "s" })} and more`);
      const columns = names.map(() => new Float64Array(rows));
      const sources = names.map((name) => (about.x.includes(name) ? [x, about.x.indexOf(name)] : [y, about.y.indexOf(name)]));
      const made = k.run({
        begin, step, rows, longest: this.of.longest,
        signals: Object.entries(signals).map(([name, s]) => [about.u.indexOf(name), Float64Array.of(s.start, ...s.changes.flat())]),
        row(r) {
          for (let n = 0; n < columns.length; n++) columns[n][r] = sources[n][0][sources[n][1]];
        },
      });
      const found = { time: Float64Array.from({ length: made }, (_, r) => begin + r * step), made, wanted: rows };
      names.forEach((name, n) => (found[name] = columns[n].subarray(0, made)));
      return found;
    }

    get states() {
      return this.k.x.slice();
    }

    set states(x) {
      this.k.x.set(x);
    }

    setInputs(signals) {
      for (const [name, s] of Object.entries(signals)) this.k.set(name, s.start);
    }

    // the next step of the integrator, 0 where none is known; it is no part of the states
    get pace() {
      return this.k.pace[0];
    }

    set pace(step) {
      this.k.pace[0] = step;
    }

    forget() {
      this.pace = 0;
    }

    rowsOf(time) {
      return Math.max(2, Math.round(time / this.of.step) + 1);
    }

    angle(run, row = run.made - 1) {
      return run[this.of.names.angle][row] / this.crankRatio();
    }

    crankRatio() {
      return this.ratio / this.of.line_ratio;
    }

    crank(run) {
      const by = this.crankRatio();
      return {
        time: run.time,
        torque: run[this.of.names.torque].map((x) => x * by),
        speed: run[this.of.names.speed].map((x) => x / by),
        current: run[this.of.names.current],
        rocker: this.of.names.rocker ? run[this.of.names.rocker] : null,
        motor: run[this.of.names.motor_torque],
      };
    }

    // start-up, with the feed of an event that is a start
    start(event = null) {
      const changes = event ? this.eventSignals(event, 0, () => 0) : {};
      const signals = this.signals(changes, true);
      this.setInputs(signals);
      this.k.start();
      const fed = this.of.empty_start ? 2 : 1, time = this.rampEnd + fed * this.of.settle_turns * this.turnTime;
      return this.of.empty_start && !event ? this.fedOnTheWay(time, signals) : this.run(0, this.rowsOf(time), signals);
    }

    // from rest for so long at least: empty, turn by turn, up to the one in which the crank is fast enough, and from
    // there on with the feed; a crank that is never fast enough gets it late
    fedOnTheWay(time, empty) {
      const late = this.rampEnd + this.of.settle_turns * this.turnTime, size = this.rowsOf(this.turnTime), runs = [];
      let begin = 0, from = null, other = null;
      while (from === null) {
        let here = { begin, count: runs.length, states: this.states, pace: this.pace };
        const run = this.run(begin, size, empty), row = this.crank(run).speed.findIndex((w) => w >= this.of.started * this.speed);
        begin += (size - 1) * this.of.step;
        if (begin > late) other = other ?? here;
        if (row >= 0) from = Math.max(run.time[row], this.of.switched_until);
        else if (run.made < size || begin > time) [from, here] = [late, other ?? here];
        else runs.push(run);
        if (from !== null) [begin, this.states, this.pace, runs.length] = [here.begin, here.states, here.pace, here.count];
      }
      const until = Math.max(time, from + this.of.settle_turns * this.turnTime);
      return joined([...runs, this.run(begin, this.rowsOf(until - begin), this.signals({}, true, from))]);
    }

    // the last turns of steady running, from the states in memory on; null where the motor does not settle
    settle(most = this.of.patience) {
      const signals = this.signals();
      const usual = (this.of.turns + 0.1) * this.turnTime;
      for (let time = usual, waited = 0, longest = most * usual; waited < longest - 0.5 * usual;) {
        this.forget();
        const run = this.run(0, this.rowsOf(time), signals);
        if (run.made < run.wanted) return null;
        if (this.isSettled(run)) return run;
        waited += time;
        const rise = this.riseOfTurn(run);
        // a start that has not ended is awaited, see chainunit.study.start_up
        if (rise && this.speedsUp(rise, waited)) longest = waited + Math.max(most * usual, 2 * waited);
        time = rise ? usual : 2 * time;
      }
      return null;
    }

    // the time of the first turn of a run, and the change of the speed over it; null where the crank makes none
    riseOfTurn(run) {
      const { speed } = this.crank(run), angle = run[this.of.names.angle], goal = angle[0] + TURN * this.crankRatio();
      const row = angle.findIndex((x) => x >= goal);
      if (row < 0) return null;
      const share = (goal - angle[row - 1]) / (angle[row] - angle[row - 1]);
      const at = (x) => x[row - 1] + share * (x[row] - x[row - 1]);
      return { span: at(run.time) - run.time[0], change: at(speed) - speed[0] };
    }

    speedsUp({ span, change }, waited) {
      const mean = TURN / span, lack = this.of.started * this.speed - mean;
      return lack > 0 && change > this.of.rises * mean && lack * span <= change * (this.of.longest_rise - waited);
    }

    isSettled(run) {
      const { speed, torque } = this.crank(run), angle = run[this.of.names.angle], first = angle[0];
      // as many whole turns as the crank makes, see chainunit.study.readings.only_whole_turns
      const turns = Math.min(this.of.turns, Math.floor((reductions.max(angle) - first) / (TURN * this.crankRatio()) + 1e-9));
      const goal = first + TURN * (turns - 1e-9) * this.crankRatio(), last = angle.findIndex((x) => x >= goal);
      // it may creep up to a load, and turn on once it is past it, see chainunit.study.block_runs
      if (turns < 1) return false;
      const share = (goal - angle[last - 1]) / (angle[last] - angle[last - 1]);
      const end = (x) => x[last - 1] + share * (x[last] - x[last - 1]);
      const inside = speed.slice(0, last + 1), ripple = reductions.max(inside) - reductions.min(inside);
      const change = end(speed) - speed[0], size = reductions.peak(inside), most = reductions.peak(torque.slice(0, last + 1));
      const gap = Math.max(Math.abs(change) / size, Math.abs(end(torque) - torque[0]) / most);
      return gap <= this.of.closed && (Math.abs(change) <= 1e-4 * size || Math.abs(change) <= this.of.drift * ripple);
    }

    value(event, name) {
      const i = quantities.findIndex((q) => q.event === event.name && q.name === name);
      return i < 0 ? event.values[name] : this.values[i];
    }

    eventSignals(event, at, state) {
      const names = (name) => {
        if (name === "at") return at;
        const dot = name.indexOf("."), of = name.slice(0, dot), own = name.slice(dot + 1);
        return of === "p" ? this.value(event, own) : of === "normal" ? this.normal(event.normal[own]) : state(event.reads[own]);
      };
      const signals = {};
      for (const [full, s] of Object.entries(event.signals))
        signals[full] = { start: evaluate(s.start, names), changes: s.changes.map((c) => c.map((x) => evaluate(x, names))) };
      return signals;
    }

    normal(full) {
      return full === this.of.reference ? this.referenceSpeed : this.inputs[full] ?? this.k.get(full);
    }

    // the event, from steady running on: time counts from its begin
    event(event, steady) {
      const angleNow = this.angle(steady), wanted = this.value(event, "crank_angle") ?? 0;
      let ahead = (wanted - angleNow) % TURN;
      if (ahead < 0) ahead += TURN;
      if (ahead < 0.125 * TURN) ahead += TURN;
      const mean = Math.max((this.angle(steady) - this.angle(steady, 0)) / (steady.time[steady.made - 1] - steady.time[0]), 0.5 * this.speed);
      const limit = (2 * ahead) / mean, before = this.states;
      this.forget();
      const wait = this.run(0, this.rowsOf(limit), this.signals());
      const goal = (angleNow + ahead) * this.crankRatio(), row = wait[this.of.names.angle].findIndex((x) => x >= goal);
      let time = limit;
      if (row > 0) {
        const angle = wait[this.of.names.angle], speed = wait[this.of.names.speed];
        // the speed hardly changes between two rows
        time = wait.time[row - 1] + (goal - angle[row - 1]) / (0.5 * (speed[row - 1] + speed[row]) || 1);
      }
      this.states = before;
      this.forget();
      const lead = this.run(0, 2, this.signals(), time);
      const state = (full) => lead[full][lead.made - 1];
      const signals = this.eventSignals(event, 0, state);
      const lasts = Math.max(0, ...Object.values(signals).flatMap((s) => s.changes.map(([at, duration]) => at + duration)));
      const turns = this.value(event, "turns") ?? 2;
      this.forget();
      const run = this.run(0, this.rowsOf(Math.max((turns + 0.1) * this.turnTime, lasts + this.turnTime)), this.signals(signals));
      return this.cut(run);
    }

    // a run until the coupling that opens passes no torque, see chainunit.study.transients.release
    cut(run) {
      if (this.trip === null) return run;
      const { loss, drag } = this.of.behind_port, limit = (this.trip * (1 + loss)) / this.ratio + drag, motor = run[this.of.names.motor_torque];
      const row = motor.findIndex((x) => Math.abs(x) >= limit);
      if (row < 0) return run;
      let tripped = run.time[row];
      if (row > 0) {
        const [a, b] = [Math.abs(motor[row - 1]), Math.abs(motor[row])];
        tripped = run.time[row - 1] + ((limit - a) / (b - a)) * (run.time[row] - run.time[row - 1]);
      }
      const made = Math.min(run.made, Math.max(row, Math.round((tripped + this.release) / this.of.step)) + 1), short = { ...run, made, tripped };
      for (const name of ["time", ...this.columns]) short[name] = run[name].slice(0, made);
      return short;
    }

    // the measures of a run with an event, by the rules of chainunit.study.measures
    measures(run) {
      const { time, torque, speed, current, rocker } = this.crank(run);
      const slow = speed.map((w) => Math.abs(w) < 0.1 * this.speed);
      let stall = null;
      if (slow[slow.length - 1]) {
        const first = slow.lastIndexOf(0) + 1;
        if (first < 0.9 * slow.length) stall = time[first];
      }
      return {
        crank_torque_peak: reductions.peak(torque),
        rocker_torque_peak: rocker ? reductions.peak(rocker) : null,
        current_peak: reductions.peak(current),
        speed_least: reductions.min(speed),
        stall_time: stall,
        coupling_trip_time: run.tripped ?? null,
      };
    }
  }

  /* the study file */
  const bare = /^[A-Za-z0-9_-]+$/;
  const keyText = (name) => (bare.test(name) ? name : JSON.stringify(name));
  const isTable = (x) => x !== null && typeof x === "object" && !Array.isArray(x);
  const valueText = (x) => {
    if (Array.isArray(x)) return `[${x.map(valueText).join(", ")}]`;
    if (isTable(x)) return `{ ${Object.entries(x).map(([name, each]) => `${keyText(name)} = ${valueText(each)}`).join(", ")} }`;
    return JSON.stringify(x);
  };
  const lines = (table, prefix) => {
    const own = [], later = [];
    for (const [name, x] of Object.entries(table)) {
      const full = prefix + keyText(name), many = Array.isArray(x) && x.length > 0 && x.every(isTable);
      if (!prefix && (isTable(x) || many)) later.push([full, x]);
      else own.push(`${keyText(name)} = ${valueText(x)}`);
    }
    for (const [full, x] of later)
      for (const each of Array.isArray(x) ? x : [x]) own.push("", Array.isArray(x) ? `[[${full}]]` : `[${full}]`, ...lines(each, full + "."));
    return own;
  };
  const studyFile = (values) => {
    const tables = JSON.parse(JSON.stringify(data.file));
    quantities.forEach((q, i) => {
      if (values[i] === study[i]) return;
      let at = tables, path = q.key;
      if (q.role === "event") [at, path] = [tables.event.find((event) => event.name === q.event), [q.name]];
      for (const name of path.slice(0, -1)) at = isTable(at[name]) ? at[name] : (at[name] = {});
      at[path[path.length - 1]] = values[i];
    });
    return lines(tables, "").join("\n").trim() + "\n";
  };

  return {
    Refusal, Runs, admits, data, digits, effects, explained, quantities, speedOf, pulls, range, reductions, refusal, results, shown, study, studyFile, turn, factorOf,
    runsOf: (values) => new Runs(values),
  };
};
if (typeof module !== "undefined") module.exports = liveModel;
