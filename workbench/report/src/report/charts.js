// Makes a chart of each picture that has its data beside it: drag or pinch to zoom, double click to see all, values under the pointer.
// What fails leaves the picture as it is.
"use strict";
const INKS = ["measured", "given", "extended", "third", "fourth", "fifth"];
const ink = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
// A value further from the pointer than this, pixels, is not told.
const NEAR = 40;
const charts = [];

// "speed, rad/s" is a name and a unit.
function named(label) {
  const comma = label.lastIndexOf(", ");
  return comma < 0 ? [label, ""] : [label.slice(0, comma), " " + label.slice(comma + 2)];
}

const told = (value, unit) => (value == null ? "–" : String(+value.toPrecision(5)).replace("-", "−") + unit);

// Whole steps, each less the one before; null is a break.
function summed(steps, size) {
  let sum = 0;
  const at = (step) => +((sum += step) * size).toPrecision(12);
  return steps.map((step) => (step === null ? null : at(step)));
}

// A chart wants abscissas that rise: equal ones come to stand beside each other, by less than anybody sees.
function rising(series, [xSize, ySize]) {
  const [x, y] = [summed(series.x, xSize), summed(series.y, ySize)];
  const order = x.map((_, k) => k).sort((a, b) => x[a] - x[b]);
  let last = -Infinity;
  const xs = order.map((k) => (last = Math.max(x[k], last + 1e-3 * xSize)));
  return [xs, order.map((k) => y[k])];
}

// The nearest value of a series: the series have their own abscissas.
function nearest(u, series, at, x) {
  const [xs, ys] = [u.data[0], u.data[series]];
  if (series === 0 || ys[at] != null) return at;
  let [before, after] = [at, at];
  while (before >= 0 && ys[before] == null) before--;
  while (after < xs.length && ys[after] == null) after++;
  const far = (k) => (ys[k] == null ? Infinity : Math.abs(u.valToPos(xs[k], "x") - u.valToPos(x, "x")));
  const near = far(before) <= far(after) ? before : after;
  return far(near) < NEAR ? near : at;
}

// What was held out and the noise lie below the curves.
function grounds(u, plot) {
  const [{ ctx }, { left, top, width, height }] = [u, u.bbox];
  const [px, py] = ["x", "y"].map((axis) => (value) => u.valToPos(value, axis, true));
  ctx.save();
  ctx.beginPath();
  ctx.rect(left, top, width, height);
  ctx.clip();
  ctx.fillStyle = ink("held");
  for (const [from, to] of plot.held) ctx.fillRect(px(from), top, px(to) - px(from), height);
  ctx.fillStyle = ink("noise");
  ctx.globalAlpha = 0.45;
  if (plot.band) ctx.fillRect(left, py(plot.band), width, py(-plot.band) - py(plot.band));
  ctx.restore();
}

function marks(u, plot) {
  const [{ ctx }, { left, top, width, height }, dot] = [u, u.bbox, devicePixelRatio];
  ctx.save();
  ctx.strokeStyle = ctx.fillStyle = ink("letters");
  ctx.setLineDash([3 * dot, 4 * dot]);
  ctx.font = 13 * dot + "px sans-serif";
  plot.marks.forEach(([x, label], k) => {
    const at = u.valToPos(x, "x", true);
    if (at < left || at > left + width) return;
    ctx.beginPath();
    ctx.moveTo(at, top);
    ctx.lineTo(at, top + height);
    ctx.stroke();
    // The labels of an edge on either side stand outside of what it encloses.
    const long = ctx.measureText(label).width + 8 * dot;
    const before = at < left + width / 2 ? at - long > left : at + long > left + width;
    ctx.textAlign = before ? "right" : "left";
    ctx.fillText(label, at + (before ? -4 : 4) * dot, top + (14 + 18 * (k % 3)) * dot);
  });
  ctx.restore();
}

function curve(series, unit) {
  const colour = () => ink(INKS[series.ink]);
  const dots = series.style === "points" || series.style === "hollow";
  const fill = () => (series.style === "hollow" ? ink("page") : colour());
  return {
    label: series.label || "value",
    stroke: colour,
    width: 2,
    dash: series.style === "dashed" ? [7, 5] : [],
    ...(dots && { paths: () => null }),
    points: { show: dots, size: 6, width: 1, stroke: colour, fill },
    value: (_, value) => told(value, unit),
  };
}

function axis(label, size) {
  const values = (_, splits) => splits.map((split) => told(split, ""));
  const line = { stroke: () => ink("grid"), width: 1 };
  return { label, size, values, grid: line, ticks: line, stroke: () => ink("letters"), labelFont: "14px sans-serif", font: "13px sans-serif" };
}

const size = (width) => ({ width, height: width > 560 ? 360 : 280 });

// Room for the longest label.
const room = (_, labels) => 24 + 7.5 * Math.max(0, ...(labels || []).map((label) => label.length));

function options(plot, data, width) {
  const [[xName, xUnit], [, yUnit]] = plot.axes.map(named);
  const band = plot.band || 0;
  const padded = (low, high, part) => [low - part * (high - low), high + part * (high - low)];
  const y = (_, low, high) => (low == null ? [0, 1] : padded(Math.min(low, band && -band), Math.max(high, band), 0.06));
  const x = (_, low, high) => padded(low, high, low === data[0][0] ? 0.02 : 0);
  // Pictures of the same time share the pointer.
  const same = xName.startsWith("time") && [xName, data[0][0], data[0].at(-1)].join();
  return {
    ...size(width),
    scales: { x: { time: false, range: x }, y: { range: y } },
    axes: [axis(plot.axes[0], 44), axis(plot.axes[1], room)],
    series: [{ label: xName, value: (_, value) => told(value, xUnit) }, ...plot.series.map((series) => curve(series, yUnit))],
    legend: { markers: { stroke: (_, k) => `var(--${INKS[plot.series[k - 1].ink]})`, fill: () => "", width: 3 } },
    cursor: { dataIdx: nearest, drag: { x: true, y: false, dist: 5 }, ...(same && { sync: { key: same } }) },
    hooks: { drawClear: [(u) => grounds(u, plot)], draw: [(u) => marks(u, plot)] },
  };
}

// Two fingers keep the values below them.
function pinch(u) {
  const fingers = new Map();
  let held = null;
  const places = () => [...fingers.values()].sort((a, b) => a - b);
  const lift = ({ pointerId }) => (fingers.delete(pointerId), (held = null));
  const put = ({ pointerId, clientX, pointerType }) => {
    if (pointerType !== "touch") return;
    fingers.set(pointerId, clientX - u.over.getBoundingClientRect().left);
    held = fingers.size === 2 ? places().map((place) => u.posToVal(place, "x")) : null;
  };
  const move = ({ pointerId, clientX }) => {
    if (!fingers.has(pointerId)) return;
    fingers.set(pointerId, clientX - u.over.getBoundingClientRect().left);
    const [a, b] = places();
    if (!held || b - a < NEAR) return;
    const per = (held[1] - held[0]) / (b - a);
    const min = held[0] - a * per;
    u.setScale("x", { min, max: min + per * u.over.clientWidth });
  };
  u.over.style.touchAction = "pan-y";
  const told = { pointerdown: put, pointermove: move, pointerup: lift, pointercancel: lift, pointerleave: lift };
  for (const [name, heard] of Object.entries(told)) u.over.addEventListener(name, heard);
}

function chart(source) {
  const [plot, figure, place] = [JSON.parse(source.textContent), source.parentElement, document.createElement("div")];
  const tables = plot.series.map((series) => rising(series, plot.steps));
  const data = uPlot.join(tables, tables.map(() => [2, 2]));
  place.className = "chart";
  source.before(place);
  const width = () => place.clientWidth || 600;
  const u = new uPlot(options(plot, data, width()), data, place);
  figure.classList.add("live");
  new ResizeObserver(() => u.setSize(size(width()))).observe(place);
  pinch(u);
  charts.push(u);
}

for (const source of document.querySelectorAll("figure > script[type='application/json']")) {
  try {
    chart(source);
  } catch (error) {
    console.error(error);
  }
}
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => charts.forEach((u) => u.redraw()));
