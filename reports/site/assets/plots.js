"use strict";
// Draws what the scripts under data/ bring: they are loaded when a plot is about to be seen, each once.
const simgap = (() => {
  const held = new Map(), asked = new Map(), drawn = new Map();
  const COLOURS = ["#1f83c6", "#e0662b", "#2f9e63", "#a25fc4", "#c99700", "#d6336c", "#0fa3a3", "#8a6d3b"];
  const DASHES = ["solid", "dash", "dot", "dashdot"];
  const fingers = matchMedia("(pointer: coarse)").matches; // they scroll the page; the buttons zoom
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

  const library = new URL("plotly.js", document.currentScript.src).href; // 5 MB: the text is there before

  function want(source) {
    if (!asked.has(source)) {
      asked.set(source, new Promise((resolve, reject) => {
        const script = document.createElement("script");
        script.onload = () => resolve(held.get(source.split("data/").pop()));
        script.onerror = () => reject(new Error(`${source} is missing; run simgap report again`));
        script.src = source;
        document.head.append(script);
      }));
    }
    return asked.get(source);
  }

  const axis = (title, more) => ({
    title: { text: title, standoff: 6 }, gridcolor: css("grid"), zeroline: false, linecolor: css("grid"),
    automargin: true, ...more,
  });

  async function draw(place, traces, layout) {
    await want(library);
    const whole = {
      template: "none", showlegend: false, margin: { l: 56, r: 12, t: 28, b: 46 }, hovermode: "closest",
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", dragmode: fingers ? false : "zoom",
      font: { family: getComputedStyle(document.body).fontFamily, size: 12, color: css("soft") }, ...layout,
    };
    return Plotly.react(place, traces, whole, { responsive: true, displayModeBar: false });
  }

  // A chart that Python has described in full: see curves.py.
  function chart(place, about) {
    let models = 0;
    const traces = about.traces.map((one) => {
      const colour = one.role === "bound" ? css("bound") : COLOURS[models++ % COLOURS.length];
      const common = { x: one.x, y: one.y, name: one.name };
      if (one.mode === "bars") return { ...common, type: "bar", marker: { color: colour } };
      const line = { color: colour, width: one.role === "bound" ? 1.2 : 1.6, dash: one.dash ?? (one.role === "bound" ? "dash" : "solid") };
      return { ...common, mode: one.mode, line, marker: { color: colour, size: 8, symbol: one.symbol ?? "circle" } };
    });
    const log = about.log ?? "";
    return draw(place, traces, {
      height: about.square ? 340 : 290, title: { text: about.title, x: 0, xref: "paper", font: { size: 13 } },
      xaxis: axis(about.x, {
        type: log.includes("x") ? "log" : "linear", nticks: 6, ...(about.square ? { constrain: "domain" } : {}),
        ...(about.ticks ? { tickvals: about.ticks, ticktext: about.tick_words ?? about.ticks } : log.includes("x") ? { dtick: 1 } : {}),
      }),
      yaxis: axis(about.y, {
        type: log.includes("y") ? "log" : "linear", nticks: 6, ...(log.includes("y") ? { exponentformat: "power" } : {}),
        ...(about.square ? { scaleanchor: "x" } : {}),
      }),
      showlegend: Boolean(about.legend), legend: { orientation: "h", y: -0.28 },
    });
  }

  // The range that holds all given ones; undefined, which leaves it to plotly, where one is open.
  const union = (ranges) => (ranges.length && ranges.every(Boolean)
    ? [Math.min(...ranges.map((r) => r[0])), Math.max(...ranges.map((r) => r[1]))] : undefined);

  // Measured and simulated outputs, errors and inputs of one record, one below the other over the same time.
  function record(place, signals, number, models) {
    const one = signals.records[number], traces = [], annotations = [], rows = [];
    const put = (row, data, name, colour, width, dash = "solid", shape = "linear") => traces.push({
      ...data, name, mode: "lines", line: { color: colour, width, dash, shape }, yaxis: row ? `y${row + 1}` : "y",
    });
    signals.outputs.forEach((name, i) => {
      const ranges = models.map((m) => m.records[number]).filter(Boolean);
      rows.push({ name, height: 220, range: union(ranges.map((r) => r.range[i])) });
      put(rows.length - 1, one.y[i], "measured", css("measured"), 2.4);
      models.forEach((m) => m.records[number] && put(rows.length - 1, m.records[number].y[i], m.name, m.colour, 1.4, m.dash));
      if (ranges.length) {
        rows.push({ name: `error of ${name}`, height: 130, range: union(ranges.map((r) => r.error_range[i])) });
        models.forEach((m) => m.records[number] && put(rows.length - 1, m.records[number].e[i], m.name, m.colour, 1.2, m.dash));
      }
    });
    signals.inputs.forEach((name, i) => {
      rows.push({ name: `input ${name}`, height: 100 });
      put(rows.length - 1, one.u[i], "input", css("input"), 1.2, "solid", "hv");
    });
    const gap = 34, inner = rows.reduce((sum, row) => sum + row.height, 0) + gap * (rows.length - 1);
    const layout = { height: inner + 76, hovermode: "x", annotations };
    let top = 1;
    rows.forEach((row, i) => {
      const bottom = Math.max(top - row.height / inner, 0), n = i ? i + 1 : "";
      layout[`yaxis${n}`] = axis("", { domain: [bottom, top], nticks: 5, anchor: "x", fixedrange: true, range: row.range });
      annotations.push({ text: row.name, showarrow: false, x: 0, xref: "paper", xanchor: "left", y: top, yref: "paper", yanchor: "bottom", font: { size: 13 } });
      top = bottom - gap / inner;
    });
    layout.xaxis = axis("time [s]", { anchor: `y${rows.length > 1 ? rows.length : ""}`, uirevision: String(number) });
    layout.uirevision = String(number); // a zoom in time stays when another model is ticked
    return draw(place, traces, layout);
  }

  function remember(place, again) {
    drawn.set(place, again);
    return again();
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => drawn.forEach((again) => again()));

  function zoom(place, action) {
    const [low, high] = place.layout.xaxis.range, middle = (low + high) / 2, half = (high - low) / 2;
    const ranges = {
      in: [middle - half / 2, middle + half / 2], out: [middle - half * 2, middle + half * 2],
      earlier: [low - half, high - half], later: [low + half, high + half],
    };
    Plotly.relayout(place, action === "all" ? { "xaxis.autorange": true } : { "xaxis.range": ranges[action] });
  }

  function charts(place, listed) {
    place.replaceChildren(...listed.map((about) => {
      const figure = document.createElement("figure"), plot = document.createElement("div"), text = document.createElement("figcaption");
      plot.className = "plot";
      plot.setAttribute("role", "img");
      plot.setAttribute("aria-label", `${about.title}. ${about.about}`);
      text.textContent = about.about;
      figure.append(plot, text);
      whenSeen(plot, () => begin(plot, () => remember(plot, () => chart(plot, about))));
      return figure;
    }));
  }

  const seen = new IntersectionObserver((entries) => entries.filter((entry) => entry.isIntersecting).forEach((entry) => {
    seen.unobserve(entry.target);
    entry.target.whenSeen();
  }), { rootMargin: "300px" });
  function whenSeen(element, act) {
    element.whenSeen = act;
    seen.observe(element);
  }

  // <div class="records" data-signals=".." > with a box per model: <input type=checkbox value="runs/..">.
  async function records(place) {
    const plot = place.querySelector(".plot"), choice = place.querySelector("select"), status = place.querySelector("output");
    const boxes = [...place.querySelectorAll("input[type=checkbox]")];
    boxes.forEach((box, i) => {
      box.colour = COLOURS[i % COLOURS.length];
      box.dash = DASHES[Math.floor(i / COLOURS.length) % DASHES.length];
      const swatch = box.parentElement.querySelector(".swatch");
      swatch.style.borderTopColor = box.colour;
      swatch.style.borderTopStyle = { solid: "solid", dash: "dashed", dot: "dotted", dashdot: "double" }[box.dash];
    });
    const signals = await want(place.dataset.signals);
    choice.replaceChildren(...signals.records.map((one, i) => new Option(one.name, i)));
    const fixed = place.dataset.run ? [{ source: place.dataset.run, colour: COLOURS[0], dash: "solid" }] : [];
    async function show() {
      const ticked = boxes.filter((box) => box.checked).map((box) => ({ source: box.value, colour: box.colour, dash: box.dash }));
      const models = await Promise.all([...fixed, ...ticked].map(async (m) => ({ ...(await want(m.source)), colour: m.colour, dash: m.dash })));
      const number = Number(choice.value);
      await remember(plot, () => record(plot, signals, number, models));
      const text = `Record ${choice.selectedOptions[0].text}: measured${models.map((m) => `, ${m.label}`).join("")}`;
      plot.setAttribute("aria-label", `${text}. The figures are in the table of this page.`);
      if (status) status.textContent = text;
    }
    place.addEventListener("change", show);
    place.querySelectorAll(".zoom button").forEach((button) => button.addEventListener("click", () => zoom(plot, button.value)));
    await show();
  }

  function complain(place, error) {
    const text = document.createElement("p");
    text.textContent = error.message;
    place.append(text);
  }
  const begin = (place, act) => Promise.resolve().then(act).catch((error) => complain(place, error));

  const idle = window.requestIdleCallback ?? setTimeout;
  addEventListener("load", () => idle(() => want(library))); // so that it is there before a plot is seen
  addEventListener("DOMContentLoaded", () => {
    document.querySelectorAll(".js-only").forEach((element) => { element.hidden = false; });
    document.querySelectorAll(".records").forEach((place) => whenSeen(place, () => begin(place, () => records(place))));
    document.querySelectorAll("[data-charts]").forEach((place) => whenSeen(place, () => begin(place, async () => {
      charts(place, (await want(place.dataset.charts)).charts);
    })));
  });
  return { have: (name, value) => held.set(name, value) };
})();
