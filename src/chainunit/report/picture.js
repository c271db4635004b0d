"use strict";
/* Adds an element of SVG to another one. */
const drawn = (parent, tag, attributes = {}, text) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  if (text !== undefined) element.textContent = text;
  parent.appendChild(element);
  return element;
};

/* The picture of a machine: a function that draws into an element of SVG. `motion` has the links, and the runs; the
   readings and the forces of a run stand in `tables`, whose first `kept` rows stay. */
const machinePicture = (stage, motion, tables) => {
  const WIDTH = 900;
  const of = (list, i) => list[Math.min(i, list.length - 1)];

  const colour = (group) => "group-" + (motion.groups.indexOf(group) + 1);
  const labelOf = (joint) => (joint in motion.names ? motion.names[joint] : joint);
  let run, frame = 0, parts, scale, origin, perNewton, height;

  const at = (joint) => {
    const j = run.joints[joint];
    return [origin[0] + scale * of(j.x, frame), origin[1] - scale * of(j.y, frame)];
  };
  const roundForce = (x) => {
    const power = 10 ** Math.floor(Math.log10(x));
    return [5, 2, 1].map((m) => m * power).find((y) => y <= x * 1.0001) || power;
  };

  // scale and origin that fit the joints, paths and tips of arrows of all runs, with room for names
  function fit() {
    const x = [], y = [];
    const reach = (list, all) => all.push(list.reduce((a, b) => Math.min(a, b)), list.reduce((a, b) => Math.max(a, b)));
    for (const r of [...motion.runs, { joints: motion.paths }])
      for (const j of Object.values(r.joints)) {
        reach(j.x, x);
        reach(j.y, y);
      }
    for (const r of motion.runs)
      for (const [centre, rim] of motion.circles.map((ends) => ends.map((name) => r.joints[name]))) {
        const radius = Math.hypot(rim.x[0] - centre.x[0], rim.y[0] - centre.y[0]);
        for (const [list, all] of [[centre.x, x], [centre.y, y]]) reach(list.flatMap((place) => [place - radius, place + radius]), all);
      }
    for (const r of motion.runs)
      for (const { at, points } of Object.values(motion.outlines)) {
        const radius = Math.max(...points.map((point) => Math.hypot(...point)));
        for (const [list, all] of [[r.joints[at].x, x], [r.joints[at].y, y]]) reach(list.flatMap((place) => [place - radius, place + radius]), all);
      }
    const ends = (list) => list.reduce((a, b) => Math.max(a, b)) - list.reduce((a, b) => Math.min(a, b));
    const size = Math.max(ends(x), ends(y)), arrow = 0.26 * size;
    for (const r of motion.runs)
      for (const force of r.largest > 0 ? r.forces : [])
        for (const [list, component, all] of [[r.joints[force.at].x, force.x, x], [r.joints[force.at].y, force.y, y]]) {
          const count = Math.max(list.length, component.length);
          reach(Array.from({ length: count }, (_, i) => of(list, i) + (arrow * of(component, i)) / r.largest), all);
        }
    const [x0, x1] = [Math.min(...x), Math.max(...x)], [y0, y1] = [Math.min(...y), Math.max(...y)];
    const margin = 0.1 * size, width = x1 - x0 + 2 * margin, depth = y1 - y0 + 2 * margin;
    // an upright linkage is not higher than four fifths of the width
    scale = Math.min(WIDTH / width, (0.8 * WIDTH) / depth);
    height = Math.round(scale * depth);
    origin = [0.5 * (WIDTH - scale * width) + scale * (margin - x0), scale * (y1 + margin)];
    stage.setAttribute("viewBox", `0 0 ${WIDTH} ${height}`);
    parts = { arrow: arrow * scale };
  }

  function drawSupports() {
    const ground = drawn(stage, "g");
    for (const name of motion.grounds) {
      const [px, py] = at(name);
      // a joint from which links hang has its support above it, another one below
      const up = motion.hanging.includes(name) ? -1 : 1;
      drawn(ground, "path", { class: "ground", d: `M${px} ${py} l-14 ${22 * up} h28 z` });
      drawn(ground, "path", {
        class: "hatch",
        d: `M${px - 22} ${py + 22 * up} h44` + [-18, -8, 2, 12].map((s) => `M${px + s} ${py + 22 * up} l8 ${8 * up}`).join(""),
      });
    }
  }

  function drawRails() {
    for (const ends of motion.rails) {
      const [ax, ay, bx, by] = ends.map((v, i) => origin[i % 2] + (i % 2 ? -scale : scale) * v);
      const length = Math.hypot(bx - ax, by - ay) || 1, ux = (bx - ax) / length, uy = (by - ay) / length;
      for (const side of [13, -13]) {
        const strokes = [`M${ax - side * uy} ${ay + side * ux} L${bx - side * uy} ${by + side * ux}`];
        for (let s = 4; s < length; s += 12) {
          const x = ax + s * ux - side * uy, y = ay + s * uy + side * ux, out = Math.sign(side) * 7;
          strokes.push(`M${x} ${y} l${-out * uy - 5 * ux} ${out * ux - 5 * uy}`);
        }
        drawn(stage, "path", { class: "rail", d: strokes.join("") });
      }
    }
  }

  // what moves, in the order in which one covers the other; names come last: no arrow covers them
  function drawMoving() {
    parts.loads = motion.links
      .filter((link) => link.name in run.loads)
      .map((link) => [link, drawn(stage, "polyline", { class: "material" })]);
    parts.links = motion.links.map((link) =>
      drawn(stage, link.closed ? "polygon" : "polyline", { class: `link ${link.look}${link.closed ? " closed" : ""}` }));
    parts.blocks = Object.keys(run.blocks).map((name) => {
      const outline = motion.outlines[name];
      if (!outline) return [name, drawn(stage, "rect", { class: "block", x: -20, y: -10, width: 40, height: 20, rx: 2 }), name];
      const points = outline.points.map(([x, y]) => `${scale * x} ${-scale * y}`).join(",");
      return [name, drawn(stage, "polygon", { class: "orbit", points }), outline.at];
    });
    for (const path of motion.paths) {
      const points = path.x.map((px, i) => `${origin[0] + scale * px} ${origin[1] - scale * of(path.y, i)}`);
      drawn(drawn(stage, "path", { class: "path", d: "M" + points.join("L") }), "title", {}, path.title);
    }
    parts.joints = {};
    for (const name of Object.keys(run.joints)) {
      parts.joints[name] = [drawn(stage, "circle", { class: "joint", r: labelOf(name) ? 5 : 3 })];
    }
    parts.forces = run.forces.map((force) => {
      const group = drawn(stage, "g", { class: `arrow ${colour(force.group)} ${force.kind}` });
      drawn(group, "title", {}, force.title);
      return {
        line: drawn(group, "path", { class: "force" }),
        head: drawn(group, "path", { class: "head" }),
        name: drawn(group, "text", { "text-anchor": "middle" }),
      };
    });
    for (const [name, part] of Object.entries(parts.joints)) {
      part.push(drawn(stage, "text", { "text-anchor": "middle", class: "joint-name" }, labelOf(name)), null);
    }
    parts.legend = drawn(stage, "g", { class: "arrow legend" });
    parts.legendLine = drawn(parts.legend, "path", { class: "force" });
    parts.legendHead = drawn(parts.legend, "path", { class: "head" });
    parts.legendText = drawn(parts.legend, "text", {});
    parts.caption = drawn(stage, "text", { x: 16, y: 28, class: "where" });
  }

  function buildTables() {
    while (tables.values.rows.length > tables.kept) tables.values.deleteRow(tables.kept);
    parts.readings = run.readings.map((reading) => {
      const row = tables.values.insertRow(), name = document.createElement("th");
      name.scope = "row";
      name.textContent = reading.title;
      row.appendChild(name);
      return row.insertCell();
    });
    tables.forces.replaceChildren();
    parts.rows = run.forces.map((force) => {
      const row = tables.forces.insertRow();
      row.className = colour(force.group);
      const head = document.createElement("th");
      head.scope = "row";
      // the name of a joint or load of a file keeps its letters
      const title = document.createElement("span");
      title.className = force.short === force.title ? "as-is" : "";
      title.textContent = force.title;
      head.appendChild(title);
      row.appendChild(head);
      return row.insertCell();
    });
  }

  function build() {
    stage.replaceChildren();
    frame = 0;
    fit();
    drawSupports();
    parts.circles = motion.circles.map((ends) => [ends, drawn(stage, "circle", { class: ends[0] === ends[1] ? "motor" : "orbit" })]);
    drawRails();
    drawMoving();
    buildTables();
  }

  function head(x, y, dx, dy) {
    const length = Math.hypot(dx, dy), h = Math.min(13, 0.6 * length), w = 0.38 * h;
    const ux = dx / length, uy = dy / length, bx = x + dx - h * ux, by = y + dy - h * uy;
    return [bx, by, `M${x + dx} ${y + dy} L${bx - w * uy} ${by + w * ux} L${bx + w * uy} ${by - w * ux} z`];
  }

  function arrow(part, x, y, dx, dy, label) {
    const length = Math.hypot(dx, dy);
    if (length < 3) {
      part.line.setAttribute("d", "");
      part.head.setAttribute("d", "");
      part.name.textContent = "";
      return;
    }
    const [bx, by, d] = head(x, y, dx, dy);
    part.line.setAttribute("d", `M${x} ${y} L${bx} ${by}`);
    part.head.setAttribute("d", d);
    part.name.textContent = length > 34 ? label : "";
    // a name is wide: beside a lying arrow it stands further off
    const half = 4 * part.name.textContent.length;
    part.name.setAttribute("x", x + dx + ((12 + half) * dx) / length);
    part.name.setAttribute("y", y + dy + (14 * dy) / length + 5);
  }

  // the distance of a point from a line between two points
  const fromLine = (x, y, [ax, ay, bx, by]) => {
    const dx = bx - ax, dy = by - ay, size = dx * dx + dy * dy || 1;
    const s = Math.max(0, Math.min(1, ((x - ax) * dx + (y - ay) * dy) / size));
    return Math.hypot(x - ax - s * dx, y - ay - s * dy);
  };

  // the name of each joint stands around it, clear of links, arrows and other names; it stays where it is clear
  function nameJoints() {
    const lines = [];
    for (const link of motion.links)
      link.joints.forEach((joint, i) => i && lines.push([...at(link.joints[i - 1]), ...at(joint)]));
    const names = [];
    run.forces.forEach((force, i) => {
      const [x, y] = at(force.at), dx = perNewton * of(force.x, frame), dy = -perNewton * of(force.y, frame);
      if (Math.hypot(dx, dy) < 3) return;
      lines.push([x, y, x + dx, y + dy]);
      const part = parts.forces[i].name;
      if (part.textContent) names.push([Number(part.getAttribute("x")), Number(part.getAttribute("y")) - 5]);
    });
    for (const joint of motion.grounds) {
      const [x, y] = at(joint), up = motion.hanging.includes(joint) ? -1 : 1;
      lines.push([x, y, x, y + 24 * up]);
    }
    const letters = parseFloat(getComputedStyle(stage).getPropertyValue("--letters")) || 15;
    for (const [name, part] of Object.entries(parts.joints)) {
      const text = part[1];
      if (!text.textContent) continue;
      const [x, y] = at(name), half = 0.3 * letters * text.textContent.length;
      const place = (k) => [x + (13 + half + 4) * Math.cos((k * Math.PI) / 6), y + (13 + 0.5 * letters) * Math.sin((k * Math.PI) / 6)];
      const room = (k) => {
        const [px, py] = place(k), ends = [-1, 0, 1].map((s) => px + s * half);
        const clear = Math.min(...ends.map((ex) => Math.min(...lines.map((each) => fromLine(ex, py, each)))));
        const apart = Math.min(99, ...names.map(([nx, ny]) => Math.max(Math.abs(nx - px) - half - 8, Math.abs(ny - py) - letters + 8)));
        const inside = Math.min(px - half, WIDTH - px - half, py - 10, height - py - 10);
        return Math.min(clear, apart, inside);
      };
      let best = part[2];
      if (best === null || room(best) < 9) {
        const rooms = Array.from({ length: 12 }, (_, k) => Math.min(room(k), 18));
        const top = rooms.indexOf(Math.max(...rooms));
        if (best === null || rooms[top] > rooms[best] + 3) best = top;
        part[2] = best;
      }
      const [px, py] = place(best);
      names.push([px, py]);
      text.setAttribute("x", px);
      text.setAttribute("y", py + 0.36 * letters);
    }
  }

  const digits = (x, n) => {
    const shown = x === 0 ? "0" : Math.abs(x) >= 100 ? x.toFixed(0) : x.toPrecision(n);
    return shown.replace("-", "−");
  };

  function draw() {
    const points = (link) => link.joints.map((joint) => at(joint).join(" ")).join(",");
    motion.links.forEach((link, i) => parts.links[i].setAttribute("points", points(link)));
    const heaviest = Math.max(1e-9, ...motion.runs.flatMap((r) => Object.values(r.loads).flat()));
    for (const [link, band] of parts.loads) {
      band.setAttribute("points", points(link));
      band.setAttribute("stroke-width", (34 * of(run.loads[link.name], frame)) / heaviest);
    }
    for (const [ends, circle] of parts.circles) {
      const [[ox, oy], [px, py]] = ends.map(at);
      for (const [name, value] of Object.entries({ cx: ox, cy: oy, r: Math.hypot(px - ox, py - oy) || 15 })) circle.setAttribute(name, value);
    }
    for (const [name, block, joint] of parts.blocks) {
      const [x, y] = at(joint);
      block.setAttribute("transform", `translate(${x} ${y}) rotate(${-of(run.blocks[name], frame)})`);
    }
    for (const [name, [dot]] of Object.entries(parts.joints)) {
      const [x, y] = at(name);
      dot.setAttribute("cx", x);
      dot.setAttribute("cy", y);
    }
    perNewton = run.largest > 0 ? (parts.arrow * tables.factor()) / run.largest : 0;
    run.forces.forEach((force, i) => {
      const [x, y] = at(force.at), fx = of(force.x, frame), fy = of(force.y, frame);
      arrow(parts.forces[i], x, y, perNewton * fx, -perNewton * fy, force.short || labelOf(force.at));
      parts.rows[i].textContent = Math.hypot(fx, fy).toFixed(0) + " N";
    });
    nameJoints();
    if (perNewton) {
      const newton = roundForce((0.75 * parts.arrow) / perNewton), x = 20, y = height - 18;
      const [bx, by, d] = head(x, y, newton * perNewton, 0);
      parts.legendLine.setAttribute("d", `M${x} ${y} L${bx} ${by} M${x} ${y - 6} v12`);
      parts.legendHead.setAttribute("d", d);
      parts.legendText.textContent = `${newton} N`;
      parts.legendText.setAttribute("x", x + newton * perNewton + 8);
      parts.legendText.setAttribute("y", y + 5);
    }
    run.readings.forEach((reading, i) => {
      const unit = reading.unit === "°" ? "°" : reading.unit ? "\u00a0" + reading.unit : "";
      parts.readings[i].textContent = digits(of(reading.values, frame), 3) + unit;
    });
    parts.caption.textContent = tables.caption(run, frame);
    stage.dataset.frame = frame;
  }

  return {
    choose(chosen) {
      run = chosen;
      build();
    },
    draw(i) {
      frame = i;
      draw();
    },
  };
};
