// Curves as SVG: ticks at round numbers, a legend, marks, the values under the pointer and a cursor at the time that
// is played.
"use strict";

const kPlot = {width: 480, height: 210, left: 56, right: 8, top: 10, bottom: 26};
const kSvg = "http://www.w3.org/2000/svg";

function svg(name, attributes, parent) {
  const e = document.createElementNS(kSvg, name);
  for (const key in attributes) e.setAttribute(key, attributes[key]);
  if (parent) parent.append(e);
  return e;
}

/// Four to eight round numbers over [low, high].
function ticks(low, high) {
  const raw = (high - low) / 5, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map(n => n * power).find(s => s >= raw);
  const all = [];
  for (let k = Math.ceil(low / step); k * step <= high + step * 1e-9; ++k) all.push(k * step);
  return all;
}

function shownNumber(v) {
  if (v === 0) return "0";
  const size = Math.abs(v);
  return size >= 1e5 || size < 1e-3 ? v.toExponential(2).replace(/\.?0+e/, "e") : String(+v.toPrecision(4));
}

function rangeOf(plot, axis) {
  let low = Infinity, high = -Infinity;
  for (const s of plot.series)
    for (const v of s[axis])
      if (v !== null) low = Math.min(low, v), high = Math.max(high, v);
  if (!(low <= high)) return [0, 1];
  if (axis === "y") low = Math.min(low, 0), high = Math.max(high, 0);
  return low < high ? [low, high] : [low, low + (Math.abs(low) || 1)];
}

/// A line that stops where there is no value.
function pathOf(s, px, py) {
  let d = "", drawn = false;
  s.x.forEach((x, i) => {
    if (s.y[i] === null) return void (drawn = false);
    d += (drawn ? "L" : "M") + px(x).toFixed(1) + " " + py(s.y[i]).toFixed(1);
    drawn = true;
  });
  return d;
}

function drawAxes(plot, picture, xs, ys, px, py) {
  const k = kPlot;
  for (const t of ticks(...ys)) {
    svg("line", {class: "grid", x1: k.left, x2: k.width - k.right, y1: py(t), y2: py(t)}, picture);
    svg("text", {x: k.left - 6, y: py(t) + 3, "text-anchor": "end"}, picture).textContent = shownNumber(t);
  }
  for (const t of ticks(...xs))
    svg("text", {x: px(t), y: k.height - 10, "text-anchor": "middle"}, picture).textContent = shownNumber(t) + " s";
  for (const mark of plot.marks || []) {
    const line = svg("line", {class: "mark", x1: px(mark.x), x2: px(mark.x), y1: k.top, y2: k.height - k.bottom}, picture);
    svg("title", {}, line).textContent = mark.label + " at " + shownNumber(mark.x) + " s";
  }
  svg("path", {class: "frame", d: `M${k.left} ${k.top}V${k.height - k.bottom}H${k.width - k.right}`}, picture);
}

/// The value of a curve at the last step up to x.
function valueAt(s, x) {
  let low = 0, high = s.x.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (s.x[middle] <= x) low = middle + 1; else high = middle;
  }
  return low > 0 ? s.y[low - 1] : null;
}

/// A section with a plot; `onTime` hears of times that are clicked. Returns {section, setTime}.
function plotSection(plot, onTime) {
  const k = kPlot, xs = rangeOf(plot, "x"), ys = rangeOf(plot, "y");
  const px = x => k.left + (x - xs[0]) / (xs[1] - xs[0]) * (k.width - k.left - k.right);
  const py = y => k.height - k.bottom - (y - ys[0]) / (ys[1] - ys[0]) * (k.height - k.top - k.bottom);
  const section = make("section", "plot");
  section.append(make("h2", "", plot.title + (plot.unit ? " [" + plot.unit + "]" : "")));
  const picture = svg("svg", {viewBox: `0 0 ${k.width} ${k.height}`, role: "img", "aria-label": plot.title});
  section.append(picture);
  drawAxes(plot, picture, xs, ys, px, py);
  plot.series.forEach((s, i) => svg("path", {class: "curve", style: `stroke:var(--c${i % 8})`, d: pathOf(s, px, py)}, picture));
  const cursor = svg("line", {class: "cursor", y1: k.top, y2: k.height - k.bottom, visibility: "hidden"}, picture);
  const legend = make("div", "legend");
  const values = plot.series.map((s, i) => {
    const entry = make("span", ""), line = make("i", ""), value = make("span", "dim");
    line.style.background = `var(--c${i % 8})`;
    entry.append(line, s.name + " ", value);
    legend.append(entry);
    return value;
  });
  section.append(legend);
  const setTime = x => {
    cursor.setAttribute("visibility", x === null ? "hidden" : "visible");
    if (x !== null) cursor.setAttribute("x1", px(x)), cursor.setAttribute("x2", px(x));
    plot.series.forEach((s, i) => {
      const y = x === null ? null : valueAt(s, x);
      values[i].textContent = y === null ? "" : shownNumber(y);
    });
  };
  const timeAt = event => {
    const box = picture.getBoundingClientRect(), at = (event.clientX - box.left) / box.width * k.width;
    const share = (at - k.left) / (k.width - k.left - k.right);
    return share < 0 || share > 1 ? null : xs[0] + share * (xs[1] - xs[0]);
  };
  let played = null;
  picture.addEventListener("pointermove", e => setTime(timeAt(e) ?? played));
  picture.addEventListener("pointerleave", () => setTime(played));
  picture.addEventListener("click", e => { const t = timeAt(e); if (t !== null && onTime) onTime(t); });
  return {section, setTime: x => setTime(played = x)};
}
