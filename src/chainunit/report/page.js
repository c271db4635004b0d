"use strict";
(() => {
  const byId = (name) => document.getElementById(name);

  /* plots */
  const config = { displaylogo: false, responsive: true, modeBarButtonsToRemove: ["lasso2d", "select2d"] };
  const plots = [];
  // the page holds the library compressed: it would otherwise be most of the page
  let figures = {};
  // panels that are too narrow beside each other stand below each other
  const isNarrow = (figure, width) => figure.narrow && width < figure.below;
  // the library changes figure.layout: the height of the wide layout is kept apart
  const heightOf = (figure, width) => (isNarrow(figure, width) ? figure.narrow.height : figure.height);
  const layoutFor = (figure, width) => (isNarrow(figure, width) ? figure.narrow : figure.wide) || {};
  const drawPlots = () => {
    for (const box of document.querySelectorAll(".plot")) {
      const figure = figures[box.dataset.figure];
      figure.height = figure.layout.height;
      box.style.height = heightOf(figure, box.clientWidth) + "px";
      Plotly.newPlot(box, figure.data, figure.layout, config);
      plots.push([box, figure]);
    }
    fit();
    document.documentElement.dataset.plots = plots.length;
  };
  const fit = () => {
    for (const [box, figure] of plots) {
      const narrow = Boolean(isNarrow(figure, box.clientWidth));
      if (!figure.narrow || box.dataset.narrow === String(narrow)) continue;
      box.dataset.narrow = narrow;
      box.style.height = heightOf(figure, box.clientWidth) + "px";
      Plotly.relayout(box, layoutFor(figure, box.clientWidth));
    }
  };
  window.addEventListener("resize", fit);
  // before the page counts as loaded: it may be printed at once
  if (document.querySelector(".plot")) {
    runPacked("plotly");
    figures = unpackedData("figures");
    drawPlots();
  }
  if (byId("live-program")) runPacked("live-program");
  // paper is narrower than a screen: a plot is laid out anew for it, so that its letters keep their size
  const PAPER = { width: 690, most: 900, two: 415, rows: 500, letters: 10, titles: 9.5, as: 900 };
  const resize = (box, figure, width, height, letters, titles, across) => {
    const layout = { ...layoutFor(figure, across), width, height, autosize: width === null, "font.size": letters };
    for (const axis of Object.keys(box.layout).filter((name) => /^[xy]axis/.test(name))) {
      layout[axis + ".title.font.size"] = titles;
      // rows are lower on paper than their titles are long: the unit has a line of its own there
      const text = box.layout[axis].title?.text;
      if (axis[0] === "y" && text) layout[axis + ".title.text"] = figure.rows > 2 && width ? text.replace(" [", "<br>[") : text.replace("<br>[", " [");
    }
    box.style.height = height + "px";
    Plotly.relayout(box, layout);
  };
  window.addEventListener("beforeprint", () => {
    for (const [box, figure] of plots) {
      // two on a page; a plot that is tall for its named rows stays so
      const height = Math.min(Math.round(0.85 * figure.height), figure.tall ? PAPER.most : figure.rows > 2 ? PAPER.rows : PAPER.two);
      resize(box, figure, PAPER.width, height, PAPER.letters, PAPER.titles, PAPER.as);
    }
  });
  window.addEventListener("afterprint", () => {
    for (const [box, figure] of plots) resize(box, figure, null, heightOf(figure, box.clientWidth), 13, 13, box.clientWidth);
  });

  /* tables and drawings that are wider than the screen say that they scroll */
  const wideBoxes = document.querySelectorAll(".wide, .drawing");
  const markWide = () => {
    for (const box of wideBoxes) {
      // beside the text there may be free space
      box.style.marginRight = "";
      const free = window.innerWidth - box.getBoundingClientRect().right - 24;
      const lacking = box.scrollWidth - box.clientWidth;
      if (lacking > 1 && free > 24 && !box.closest(".given")) box.style.marginRight = -Math.min(lacking, free) + "px";
      const room = box.scrollWidth - box.clientWidth;
      box.classList.toggle("scrolls", getComputedStyle(box).overflowX === "auto" && room > 1);
      box.classList.toggle("at-end", box.scrollLeft > room - 2);
    }
  };
  for (const box of wideBoxes) box.addEventListener("scroll", markWide, { passive: true });
  window.addEventListener("resize", markWide);
  markWide();

  /* the machine in motion */
  const stage = byId("stage");
  if (!stage) return;
  const motion = unpackedData("pictures");
  const select = byId("run"), factor = byId("factor"), arrows = byId("arrows"), slider = byId("slider");
  let run, frame, playTime, playing = false, last = null;
  motion.runs.forEach((r, i) => select.add(new Option(r.title, i)));
  const factors = [0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1, 2];
  for (const f of factors) factor.add(new Option("× " + f, f));
  // a crank turn lasts a second at least
  factor.value = factors.filter((f) => f <= 1 && motion.turn / f >= 1).pop() || factors[0];
  const picture = machinePicture(stage, motion, {
    values: byId("read-values"),
    kept: 1,
    forces: byId("read-forces"),
    factor: () => Number(arrows.value),
    caption: (r, i) => `${r.title}, ${r.event ? "event" : "start"} ${r.time[i] < 0 ? "−" : "+"} ${Math.abs(r.time[i]).toFixed(2)} s`,
  });

  function draw() {
    picture.draw(frame);
    const time = run.time[Math.min(frame, run.time.length - 1)].toFixed(3).replace("-", "−") + " s";
    byId("read-time").textContent = time;
    slider.value = frame;
    slider.setAttribute("aria-valuetext", time);
    stage.dataset.run = run.name;
  }

  function show(i) {
    frame = Math.max(0, Math.min(run.time.length - 1, i));
    playTime = run.time[frame];
    draw();
  }

  function choose(i) {
    run = motion.runs[i];
    picture.choose(run);
    slider.max = run.time.length - 1;
    byId("time-name").textContent = run.event ? "Time after the event" : "Time";
    const still = Math.min(run.still, run.time.length - 1), tick = byId("tick");
    tick.textContent = run.event ? "▾ event" : still > 0 ? "▾ steady" : "";
    tick.style.left = `calc(8px + (100% - 16px) * ${still / Math.max(1, run.time.length - 1)})`;
    show(run.event ? 0 : still);
  }

  function frameAt(time) {
    let low = 0, high = run.time.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (run.time[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  function advance(now) {
    if (!playing) return;
    // after a pause, or a while in another tab, the motion goes on from the same picture
    if (last !== null) playTime += (Math.min(now - last, 250) / 1000) * Number(factor.value);
    last = now;
    if (playTime > run.time[run.time.length - 1]) playTime = run.time[0];
    const next = frameAt(playTime);
    if (next !== frame) {
      frame = next;
      draw();
    }
    requestAnimationFrame(advance);
  }

  function play(on) {
    playing = on;
    const button = byId("play");
    button.textContent = on ? "❚❚ Pause" : "▶ Play";
    button.setAttribute("aria-label", on ? "Pause" : "Play");
    if (on) {
      last = null;
      requestAnimationFrame(advance);
    }
  }

  byId("play").addEventListener("click", () => play(!playing));
  select.addEventListener("change", () => choose(Number(select.value)));
  arrows.addEventListener("change", draw);
  slider.addEventListener("input", () => show(Number(slider.value)));
  choose(0);
  // report.html#play=jam_left plays that run by itself, report.html#at=jam_left,0.2 shows it at that time
  const request = /^#(play|at)(?:=([^,]*)(?:,(.*))?)?$/.exec(location.hash);
  if (request) {
    const index = motion.runs.findIndex((r) => r.name === request[2]);
    if (index >= 0) {
      select.value = index;
      choose(index);
    }
    if (request[3]) show(frameAt(Number(request[3])));
    byId("machine").scrollIntoView({ behavior: "instant" });
    play(request[1] === "play");
  }
})();
