/* Steps of a printed model in the time: the integrators of chainunit.core.integrators, with the same numbers in the same
   order, and the profiles of chainunit.system.signals. A signal is [place of its input, numbers]: the value at first, and
   for each change its begin [s], its duration [s] and the value after it. */
const profileAt = (s, t) => {
  let value = s[0], before = s[0];
  for (let k = 1; k < s.length; k += 3) {
    const z = Math.min(Math.max((t - s[k]) / s[k + 1], 0), 1);
    value = value + (s[k + 2] - before) * (z * z * z * (10 + z * (6 * z - 15)));
    before = s[k + 2];
  }
  return value;
};
const stepped = (m) => {
  if (!m.derivatives) return m;
  const n = m.x.length, { u, x, rates } = m, { controlled, free, rounds, nominal } = m.about;
  const most = m.about.p.indexOf("solver.max_steps"), stages = NODES.length;
  const [before, now, from, slope] = NODES.map(() => new Float64Array(n));
  // the derivatives at all stages, and their weights, one stage after the other
  const k = new Float64Array(stages * n), weights = new Float64Array(stages), inner = new Float64Array(stages * stages);
  STAGES.forEach((row, s) => inner.set(row, s * stages));
  // the time of the end of the last substep, its size, and the next one [s]
  const last = new Float64Array(3), SINCE = 0, SIZE = 1, PACE = 2;
  let moving = [];
  // a loop, as a method of arrays takes longer for so few numbers
  const copy = (to, of, first = 0) => {
    for (let i = 0; i < n; i++) to[first + i] = of[i];
  };
  const at = (t) => {
    for (let n = 0; n < moving.length; n++) u[moving[n][0]] = profileAt(moving[n][1], t);
  };
  const ratesAt = (t) => {
    at(t);
    m.derivatives();
  };
  // the first time behind a time at which a change begins or ends
  const nextBend = (t) => {
    let bend = Infinity;
    for (let n = 0; n < moving.length; n++)
      for (let k = 1, s = moving[n][1]; k < s.length; k += 3) {
        const begin = s[k], end = begin + s[k + 1];
        if (begin > t) bend = Math.min(bend, begin);
        else if (end > t) bend = Math.min(bend, end);
      }
    return bend;
  };
  // equal substeps; false where they are too many
  const even = (begin, step, longest) => {
    let count = step / longest - 1e-9;
    if (count > m.p[most]) return false;
    count = Math.max(1, Math.ceil(count));
    const h = step / count;
    for (let taken = 0; taken < count; taken++) {
      copy(now, x);
      copy(from, x);
      for (let s = 0; s < RK4_NODES.length; s++) {
        if (s) for (let i = 0; i < n; i++) x[i] = now[i] + RK4_NODES[s] * h * rates[i];
        ratesAt(begin + (taken + RK4_NODES[s]) * h);
        for (let i = 0; i < n; i++) from[i] = from[i] + RK4_WEIGHTS[s] * h * rates[i];
      }
      copy(x, from);
    }
    return true;
  };
  // substeps with error control until the end of one is `until`; false where they are too many, or leave all bounds
  const substeps = (begin, until, end, longest, between) => {
    const shortest = SHORTEST * longest, tolerance = m.tolerance_[0];
    let since = last[SINCE], pace = last[PACE] || FIRST * longest;
    for (let taken = 1; since < until; taken++) {
      if (taken > m.p[most]) return false;
      const limit = between ? Math.min(end, nextBend(since)) : end, left = limit - since;
      const h = pace >= left ? left : pace > 0.5 * left ? 0.5 * left : pace;
      if (between) copy(k, slope);
      else {
        copy(x, now);
        ratesAt(begin + since);
        copy(k, rates);
      }
      for (let s = 1, row = stages; s < stages; s++, row += stages) {
        for (let i = 0; i < n; i++) {
          let sum = inner[row] * k[i];
          for (let j = 1, place = n + i; j < s; j++, place += n) sum = sum + inner[row + j] * k[place];
          x[i] = now[i] + h * sum;
        }
        ratesAt(begin + (since + h * NODES[s]));
        copy(k, rates, s * n);
      }
      let error = 0, finite = 0;
      for (let i = 0; i < n; i++) {
        finite = finite + x[i] * 0 + rates[i] * 0;
        let sum = ERRORS[0] * k[i];
        for (let s = 1; s < stages; s++) sum = sum + ERRORS[s] * k[s * n + i];
        error = Math.max(error, Math.abs(h * sum) / (tolerance * Math.max(Math.abs(now[i]), Math.abs(x[i]), nominal[i])));
      }
      const usable = finite === 0, least = h <= shortest;
      if (!usable && least) return false;
      if (usable && (error <= 1 || least)) {
        since = h >= left ? limit : since + h;
        if (between) {
          copy(from, now);
          copy(now, x);
          copy(slope, rates);
          last[SIZE] = h;
        } else {
          at(begin + since);
          m.closed();
          copy(now, m.closed_);
        }
      }
      const growth = error < NO_ERROR ? MOST_GROWTH : SAFETY * exponential(ERROR_POWER * logarithm(error));
      let next = h * (usable ? Math.min(Math.max(growth, LEAST_GROWTH), MOST_GROWTH) : LEAST_GROWTH);
      // a substep that the end of the step shortened does not shorten the next one
      if (usable && error <= 1 && h < pace) next = Math.max(next, pace);
      pace = Math.min(Math.max(next, shortest), longest);
    }
    [last[SINCE], last[PACE]] = [since, pace];
    return true;
  };
  // the states at a time of the last substep
  const interpolate = (time) => {
    if (time >= last[SINCE]) return copy(x, now);
    const size = last[SIZE], z = (time - last[SINCE]) / size + 1;
    for (let s = 0; s < stages; s++) {
      const d = DENSE[s];
      weights[s] = (((d[3] * z + d[2]) * z + d[1]) * z + d[0]) * z * size;
    }
    for (let i = 0; i < n; i++) {
      let sum = from[i];
      for (let s = 0; s < stages; s++) sum = sum + k[s * n + i] * weights[s];
      x[i] = sum;
    }
  };
  const start = () => {
    if (m.guess) m.guess();
    for (let n = 0; m.improved && n < rounds; n++) {
      m.improved();
      m.z.set(m.improved_);
    }
    m.initial();
    last[PACE] = 0;
  };
  // from the states in `x` on: rows a step [s] apart, the first at the time `begin`. `row` takes the number of each whose
  // outputs are in `y`. Returns how many there are: fewer where the states leave all bounds, or a step takes too many
  // substeps. Substeps are at most `longest` [s], 0 for that of the model. They end at each row, or `between` them where
  // the states have no constraints; then the states of a row are interpolated.
  const run = ({ begin, step, rows, longest = 0, signals = [], row, between = free }) => {
    moving = signals.filter(([, s]) => s.length > 1);
    for (const [place, s] of signals) u[place] = s[0];
    if (!longest) [longest] = (m.internal_step(), m.internal_step_);
    if (controlled) m.tolerance();
    copy(now, x);
    last[SINCE] = begin;
    if (between) {
      ratesAt(begin);
      copy(slope, rates);
    }
    for (let r = 0; ; ) {
      at(begin + r * step);
      m.values();
      row(r);
      if (++r >= rows) return r;
      copy(before, x);
      let done, finite = 0;
      if (between) {
        const time = begin + r * step;
        done = substeps(0, time, begin + (rows - 1) * step, longest, true);
        if (done) interpolate(time);
      } else if (controlled) {
        copy(now, x);
        last[SINCE] = 0;
        done = substeps(begin + (r - 1) * step, step, step, longest, false);
        copy(x, now);
      } else done = even(begin + (r - 1) * step, step, longest);
      for (let i = 0; i < n; i++) finite = finite + x[i] * 0;
      if (!done || finite !== 0) {
        copy(x, before);
        return r;
      }
    }
  };
  // the next substep, 0 where none is known; it is no part of the states
  return { ...m, start, run, pace: last.subarray(PACE) };
};
