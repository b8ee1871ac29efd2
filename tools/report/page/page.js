// Puts the page together from its data.
"use strict";

function make(name, style, text) {
  const e = document.createElement(name);
  if (style) e.className = style;
  if (text !== undefined) e.textContent = text;
  return e;
}

function section(title, wide) {
  const s = make("section", wide ? "wide" : "");
  s.append(make("h2", "", title));
  return s;
}

function row(cells, kind) {
  const r = make("tr", "");
  for (const c of cells) {
    const cell = make(kind || "td", typeof c === "number" ? "number" : "");
    if (c instanceof Node) cell.append(c); else cell.textContent = typeof c === "number" ? shownNumber(c) : c ?? "";
    r.append(cell);
  }
  return r;
}

function head(data) {
  const h = document.getElementById("head");
  h.append(make("h1", "", data.name), make("span", "status", data.status));
  h.append(make("span", "dim", (data.program ? data.program + ", " : "") + data.updated));
  if (data.status === "running") h.append(make("span", "dim", "still running: load the page again to see more"));
}

function summarySection(data) {
  const s = section("Summary"), table = make("table", "");
  for (const [label, value] of data.summary) table.append(row([label, value]));
  s.append(table);
  return s;
}

function stagesSection(data) {
  const s = section("Time by stage"), list = make("div", "stages");
  const sum = data.stages.reduce((a, b) => a + b.seconds, 0) || 1;
  for (const {name, seconds} of data.stages) {
    const bar = make("div", ""), share = make("div", "share");
    share.style.width = 100 * seconds / data.stages[0].seconds + "%";
    bar.append(share);
    list.append(make("span", "", name), bar, make("span", "dim", `${shownNumber(+seconds.toPrecision(3))} s, ${Math.round(100 * seconds / sum)} %`));
  }
  s.append(list);
  return s;
}

/// Returns {section, choose}.
function fragmentsSection(data, onChoice) {
  const s = section("Fragments"), box = make("div", "scroll"), table = make("table", "");
  table.append(row(["Number", "Body", "Of", "Since", "Volume at rest"], "th"));
  const rows = new Map();
  for (const f of data.fragments) {
    const r = row([String(f.id), f.body, f.parent === null ? "" : String(f.parent), shownNumber(f.birth) + " s", shownNumber(f.volume) + " m³"]);
    r.addEventListener("click", () => onChoice(f.id));
    rows.set(f.id, r);
    table.append(r);
  }
  box.append(table), s.append(box);
  const choose = id => rows.forEach((r, of) => { r.className = of === id ? "chosen" : ""; });
  return {section: s, choose};
}

function sceneSection(data) {
  const s = section("Scene, with all defaults", true), box = make("div", "scroll");
  box.append(make("pre", "", data.scene)), s.append(box);
  return s;
}

function pictureSection(data) {
  const s = section("Frames", true), image = make("img", "");
  image.src = data.sheet, image.alt = "frames of the run", s.append(image);
  return s;
}

/// The colours of values from 0 to the highest, evenly in the value.
function rampBar(byRoot) {
  const bar = make("i", ""), stops = 16;
  const at = k => "#" + rampColour(byRoot ? Math.sqrt(k / stops) : k / stops).getHexString();
  bar.style.background = `linear-gradient(to right, ${Array.from({length: stops + 1}, (_, k) => at(k)).join(", ")})`;
  return bar;
}

function controlsOf(player, frames) {
  const bar = make("div", "bar"), play = make("button", "", "Play"), slider = make("input", ""), label = make("span", "dim"), mode = make("select", "");
  Object.assign(slider, {type: "range", min: 0, max: frames.length - 1, value: frames.length - 1});
  slider.setAttribute("aria-label", "frame");
  const values = player.data.values || [];
  for (const [value, text] of [["material", "Materials"], ["torn", "Torn faces"], ["fragment", "Fragments"], ...values.map(v => [v.name, v.label])])
    mode.append(Object.assign(make("option", "", text), {value}));
  const legend = make("span", "ramp dim");
  legend.hidden = true;
  const view = make("button", "", "Whole view");
  let timer = null;
  const stop = () => { clearInterval(timer), timer = null, play.textContent = "Play"; };
  const start = () => {
    play.textContent = "Pause";
    let busy = false;
    timer = setInterval(async () => {  // a frame that takes longer holds the next ones back
      if (busy) return;
      busy = true;
      await player.show((player.frame + 1) % frames.length);
      busy = false;
    }, 1000 / 24);
  };
  play.addEventListener("click", () => timer ? stop() : start());
  slider.addEventListener("input", () => { stop(); player.show(+slider.value); });
  mode.addEventListener("change", () => {
    const value = values.find(v => v.name === mode.value);
    legend.hidden = !value;
    if (value) legend.replaceChildren(shownNumber(+value.low.toPrecision(3)), rampBar(value.byRoot), `${shownNumber(+value.high.toPrecision(3))} ${value.unit}`);
    player.setMode(mode.value);
  });
  view.addEventListener("click", () => { player.look(); player.draw(); });
  bar.append(play, slider, label, mode, legend, view);
  const shown = i => { slider.value = i, label.textContent = `frame ${frames[i].frame}, ${frames[i].time.toFixed(3)} s`; };
  return {bar, shown};
}

/// The player with its controls. `plots` follow its time.
function playerSection(data, plots, fragments) {
  const s = section("Turn with the pointer, click a fragment", true), canvas = make("canvas", ""), chosen = make("span", "dim");
  s.classList.add("player"), s.append(canvas);
  const frames = data.player.frames;
  let controls = null;
  const player = new Player(data.player, canvas, i => {
    controls.shown(i);
    plots.forEach(p => p.setTime(frames[i].time));
  }, id => {
    chosen.textContent = id === null ? "" : `fragment ${id}`;
    fragments.choose(id);
  });
  controls = controlsOf(player, frames);
  controls.bar.append(chosen), s.append(controls.bar);
  return {section: s, player};
}

function runPage(data) {
  const main = document.getElementById("main");
  let player = null;
  const frames = data.player ? data.player.frames : [];
  const nearest = t => frames.reduce((best, f, i) => Math.abs(f.time - t) < Math.abs(frames[best].time - t) ? i : best, 0);
  const fragments = fragmentsSection(data, id => player?.select(id));
  const plots = data.plots.map(p => plotSection(p, t => player?.show(nearest(t))));
  if (data.player) {
    try {
      const made = playerSection(data, plots, fragments);
      player = made.player, main.append(made.section);
    } catch (error) {
      const s = section("Frames to turn", true);
      s.append(make("p", "dim", "This browser gives no WebGL, so the frames cannot be drawn in 3-D: " + error.message));
      main.append(s);
    }
  }
  main.append(summarySection(data), stagesSection(data), fragments.section, ...plots.map(p => p.section));
  if (data.sheet) main.append(pictureSection(data));
  main.append(sceneSection(data));
  return player;
}

/// Rows of a table by a column, numbers by size and behind them texts.
function sortBy(table, column, falling) {
  const key = r => { const t = r.cells[column].textContent; return isNaN(+t) || t === "" ? t : +t; };
  const order = (a, b) => typeof a === typeof b ? (a < b ? -1 : a > b ? 1 : 0) : typeof a === "number" ? -1 : 1;
  const rows = [...table.rows].slice(1).sort((a, b) => (falling ? -1 : 1) * order(key(a), key(b)));
  table.append(...rows);
}

function linkOf(run) {
  if (!run.report) return document.createTextNode(run.name);
  return Object.assign(make("a", "", run.name), {href: run.report});
}

function comparedTable(data) {
  const s = section("Runs", true), box = make("div", "scroll"), table = make("table", "");
  const numbers = [...new Set(data.runs.flatMap(r => Object.keys(r.numbers)))];
  const top = row(["Run", ...data.keys, "Status", ...numbers], "th");
  [...top.cells].forEach((cell, i) => {
    cell.classList.add("sort"), cell.title = "sort";
    let falling = true;
    cell.addEventListener("click", () => sortBy(table, i, falling = !falling));
  });
  table.append(top);
  for (const r of data.runs) table.append(row([linkOf(r), ...r.values, r.status, ...numbers.map(n => r.numbers[n])]));
  box.append(table), s.append(box);
  return s;
}

function comparedPictures(data) {
  const s = section("Last frames", true), grid = make("div", "runs");
  for (const r of data.runs) {
    const figure = make("figure", ""), caption = make("figcaption", "");
    if (r.picture) figure.append(Object.assign(make("img", ""), {src: r.picture, alt: "last frame of run " + r.name}));
    caption.append(linkOf(r), ": " + data.keys.map((k, i) => `${k} = ${r.values[i]}`).join(", ") + ` (${r.status})`);
    figure.append(caption), grid.append(figure);
  }
  s.append(grid);
  return s;
}

function wedgePage(data) {
  const main = document.getElementById("main");
  main.append(comparedTable(data));
  if (data.runs.some(r => r.picture)) main.append(comparedPictures(data));
  main.append(...data.plots.map(p => plotSection(p).section));
}

(async () => {
  const data = JSON.parse(document.getElementById("data").textContent);
  head(data);
  const player = data.kind === "run" ? runPage(data) : wedgePage(data);
  // For scripts that look at the page.
  const report = window.vdbfracReport = {kind: data.kind, player, frameCount: data.player ? data.player.frames.length : 0, ready: false};
  if (player) {
    player.resize();
    await player.show(report.frameCount - 1);
  }
  report.ready = true;
})();
