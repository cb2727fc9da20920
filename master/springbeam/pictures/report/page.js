"use strict";
// Draws the charts of #data, moves the bodies with the slider, and keeps the time axes alike.
(() => {
  for (const button of document.querySelectorAll(".fold")) {
    const members = button.closest("tbody").nextElementSibling;
    members.hidden = true; // by the script: without one all events show
    button.addEventListener("click", () => {
      members.hidden = !members.hidden;
      button.setAttribute("aria-expanded", String(!members.hidden));
    });
  }
  const page = JSON.parse(document.getElementById("data").textContent);
  if (!page) return;
  const PRINT_WIDTH = 680; // of A4 between its margins, in CSS pixels
  const WHOLE_RUN = 10000; // ms, at speed 1
  const byId = (id) => document.getElementById(id);
  const config = { displaylogo: false, responsive: true, modeBarButtonsToRemove: ["select2d", "lasso2d"] };

  // A finger that moves across a chart as wide as the screen scrolls the page.
  const dragmode = matchMedia("(pointer: coarse)").matches ? false : "zoom";

  // The look that all charts share.
  const axis = {
    gridcolor: "#E3E3E3", zeroline: false, showline: true, linecolor: "#000000", ticks: "outside", ticklen: 4,
    exponentformat: "power", title: { standoff: 6 },
  };
  const layout = {
    margin: { l: 66, r: 14, t: 10, b: 42 },
    font: { family: "system-ui, sans-serif", size: 12, color: "#222222" },
    paper_bgcolor: "white",
    plot_bgcolor: "white",
    hovermode: "x",
    showlegend: true,
    legend: { orientation: "h", x: 0, xanchor: "left", y: 1, yanchor: "bottom" },
    xaxis: axis,
    yaxis: { ...axis, zeroline: true, zerolinecolor: "#777777", zerolinewidth: 1 },
  };

  for (const name of page.overTime) page.charts[name].layout.shapes = [...page.backdrop];
  for (const chart of Object.values(page.charts)) Object.assign(chart.layout, { dragmode, template: { layout } });
  for (const [name, chart] of Object.entries(page.charts)) Plotly.newPlot(name, chart.data, chart.layout, config);

  // One time axis for all.
  const home = page.overTime.map((name) => [...page.charts[name].layout.xaxis.range])[0];
  let linking = false;
  for (const name of page.overTime) {
    byId(name).on("plotly_relayout", (change) => {
      if (linking || !Object.keys(change).some((key) => key.startsWith("xaxis."))) return;
      linking = true;
      const range = change["xaxis.autorange"] ? home : [...byId(name).layout.xaxis.range];
      const others = page.overTime.map((other) => Plotly.relayout(other, { "xaxis.range": [...range] }));
      Promise.all(others).then(() => { linking = false; });
    });
  }

  // The time shown above, as a line through every chart: an element of its own, because to move a line of plotly's
  // takes tens of milliseconds a chart.
  const cursors = page.motion ? page.overTime.map((name) => {
    const line = document.createElement("div");
    line.className = "cursor";
    byId(name).append(line);
    byId(name).on("plotly_afterplot", () => { measure(cursor); place(cursor); });
    const cursor = { chart: byId(name), line };
    return cursor;
  }) : [];
  let shown = 0; // [page.unit]
  function measure(cursor) {
    const area = cursor.chart.querySelector(".nsewdrag").getBoundingClientRect();
    const frame = cursor.chart.getBoundingClientRect();
    cursor.left = area.left - frame.left;
    cursor.width = area.width;
    cursor.line.style.top = `${area.top - frame.top}px`;
    cursor.line.style.height = `${area.height}px`;
  }
  function place(cursor) {
    const [from, to] = cursor.chart.layout.xaxis.range;
    const part = (shown - from) / (to - from);
    cursor.line.hidden = part < 0 || part > 1;
    cursor.line.style.transform = `translateX(${cursor.left + part * cursor.width}px)`;
  }
  cursors.forEach(measure);

  window.addEventListener("beforeprint", () => {
    for (const name of Object.keys(page.charts)) Plotly.relayout(name, { width: PRINT_WIDTH });
    cursors.forEach(measure);
    cursors.forEach(place);
  });
  window.addEventListener("afterprint", () => {
    for (const name of Object.keys(page.charts)) Plotly.relayout(name, { width: null, autosize: true });
  });

  const motion = page.motion;
  if (!motion) return;
  const last = motion.time.length - 1;
  const slider = byId("slider"), button = byId("play"), reading = byId("reading");

  const heights = (part, move, k) => {
    if (part === "beam") return motion.deflection[k].map((u) => move.factor * u);
    if (part === "top") return [move.factor * motion.y[k], move.factor * motion.y[k]];
    return motion.coil.map((s) => move.factor * (motion.foot + s * (motion.y[k] - motion.foot)));
  };

  function show(k) {
    slider.value = k;
    for (const [name, move] of Object.entries(motion.parts)) {
      Plotly.restyle(name, { y: move.traces.map((part) => heights(part, move, k)) }, [...move.traces.keys()]);
    }
    shown = page.unit.factor * motion.time[k];
    cursors.forEach(place);
    const values = motion.readings.map((r) => `${r.words} = ${(r.factor * r.values[k]).toPrecision(4)} ${r.unit}`);
    const items = [`t = ${motion.time[k].toPrecision(6)} s`, motion.phase[k], ...values];
    reading.textContent = items.map((item) => item.replaceAll(" ", "\u00a0")).join(" · ");
  }

  // The last frame not after a time [s].
  const frameAt = (time) => {
    let low = 0, high = last;
    while (low < high) {
      const middle = Math.ceil((low + high) / 2);
      if (motion.time[middle] <= time) low = middle; else high = middle - 1;
    }
    return low;
  };

  let playing = false;
  function stop() {
    playing = false;
    button.textContent = "▶ Play";
    button.setAttribute("aria-label", "Play");
  }
  function play() {
    if (Number(slider.value) >= last) show(0);
    playing = true;
    button.textContent = "❚❚ Pause";
    button.setAttribute("aria-label", "Pause");
    let time = motion.time[Number(slider.value)], before = performance.now();
    const span = motion.time[last] - motion.time[0];
    const tick = (now) => {
      if (!playing) return;
      time += (now - before) / WHOLE_RUN * Number(byId("speed").value) * span;
      before = now;
      const k = frameAt(time);
      if (k !== Number(slider.value)) show(k);
      if (k >= last) stop(); else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  button.addEventListener("click", () => (playing ? stop() : play()));
  slider.addEventListener("input", () => { stop(); show(Number(slider.value)); });
  const jump = (time) => { stop(); show(frameAt(time)); };
  for (const link of document.querySelectorAll(".jump")) {
    link.addEventListener("click", () => { jump(Number(link.dataset.time)); byId("animation").scrollIntoView(); });
  }
  for (const name of page.overTime) {
    byId(name).on("plotly_click", (event) => jump(event.points[0].x / page.unit.factor));
  }
  show(0);
})();
