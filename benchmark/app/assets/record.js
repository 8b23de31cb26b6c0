// Draws the columns of a record, and sends what is said of them.
const form = document.getElementById("said"), refusal = document.getElementById("refusal"), plot = document.getElementById("plot");
const rows = [...form.querySelectorAll("tr[data-column]")];
const { curves, x_title: xTitle } = JSON.parse(document.getElementById("look").textContent);
const field = (row, name) => row.querySelector(`[name=${name}]`);
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const plain = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;");

function draw() {
  const colours = { input: css("input"), output: css("accent"), simulated: css("bound"), "": css("measured") };
  const shown = curves.map((curve) => [curve, rows.find((row) => row.dataset.column === curve.heading)])
    .sort(([, a], [, b]) => (field(a, "role").value === "") - (field(b, "role").value === "")).slice(0, 12);
  const height = 120, gap = 30, inner = shown.length * (height + gap) - gap;
  const axis = (more) => ({ gridcolor: css("grid"), zeroline: false, linecolor: css("grid"), automargin: true, ...more });
  const layout = {
    template: "none", showlegend: false, hovermode: "x", height: inner + 84, margin: { l: 56, r: 12, t: 28, b: 56 },
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", dragmode: matchMedia("(pointer: coarse)").matches ? false : "zoom",
    font: { family: getComputedStyle(document.body).fontFamily, size: 12, color: css("soft") }, annotations: [],
  };
  const traces = shown.map(([curve, row], i) => {
    const n = i ? i + 1 : "", role = field(row, "role").value, unit = field(row, "unit").value.trim();
    const top = 1 - i * (height + gap) / inner;
    layout[`yaxis${n}`] = axis({ domain: [Math.max(top - height / inner, 0), top], nticks: 4, fixedrange: true, anchor: "x" });
    const name = row.querySelector("th").textContent + (unit ? ` [${unit}]` : "") + (role ? `, ${role}` : ", left out");
    layout.annotations.push({ text: plain(name), showarrow: false, x: 0, xref: "paper", xanchor: "left", y: top, yref: "paper", yanchor: "bottom", font: { size: 13 } });
    return { x: curve.x, y: curve.y, name: plain(name), mode: "lines", hoverinfo: "x+y", yaxis: `y${n}`, line: { color: colours[role], width: 1.4, shape: role === "input" ? "hv" : "linear" } };
  });
  layout.xaxis = axis({ title: { text: xTitle, standoff: 6 }, anchor: `y${shown.length > 1 ? shown.length : ""}` });
  Plotly.react(plot, traces, layout, { responsive: true, displayModeBar: false });
}

function follow() { // a kind is said of outputs only
  rows.forEach((row) => { field(row, "kind").disabled = field(row, "role").value !== "output"; });
  if (curves.length && window.Plotly) draw();
}

function number(name, what) {
  const text = form.elements[name]?.value.trim().replace(",", ".") ?? "";
  if (text && !(Number(text) > 0)) throw new Error(`${what} is a positive number of seconds, such as 0.01`);
  return text ? Number(text) : null;
}

function settings() {
  const of = (role) => rows.filter((row) => !field(row, "role").disabled && field(row, "role").value === role).map((row) => row.dataset.column);
  const isFixed = rows.some((row) => field(row, "role").disabled);
  const used = rows.filter((row) => field(row, "role").value && field(row, "role").value !== "simulated");
  if (!isFixed && !(of("input").length && of("output").length)) throw new Error("Say which columns are inputs and which are outputs: at least one of each.");
  const resample = number("resample", "The step of the even grid"), splitGaps = form.elements.split_gaps?.checked ?? false;
  const dt = resample === null ? number("dt", "The sampling time") : null;
  const byClock = resample !== null || (splitGaps && form.elements.resample); // a column tells the time then
  if (form.elements.dt && dt === null && !byClock) throw new Error("Say the sampling time in seconds: no column tells the time.");
  return {
    inputs: of("input"), outputs: of("output"), simulated: of("simulated"), dt, resample,
    units: Object.fromEntries(used.map((row) => [row.dataset.column, field(row, "unit")]).filter(([, unit]) => unit.value.trim() !== unit.dataset.read).map(([column, unit]) => [column, unit.value.trim()])),
    kinds: Object.fromEntries(used.map((row) => [row.dataset.column, field(row, "kind")]).filter(([, kind]) => !kind.disabled && kind.value).map(([column, kind]) => [column, kind.value])),
    split_gaps: splitGaps,
    known: form.elements.known.value.split("\n").map((line) => line.trim()).filter(Boolean),
  };
}

function refuse(error) {
  refusal.textContent = error instanceof TypeError ? "simgap open has ended: start it again" : error.message;
  refusal.hidden = false;
}

form.addEventListener("submit", async (event) => {
  event.preventDefault();
  refusal.hidden = true;
  const button = form.querySelector("[type=submit]");
  try {
    const body = JSON.stringify(settings());
    button.disabled = true;
    const answer = await (await fetch("diagnoses", { method: "POST", headers: { "Content-Type": "application/json" }, body })).json();
    if (answer.refused) throw new Error(answer.refused);
    location.href = `${answer.number}/`;
  } catch (error) {
    refuse(error);
    button.disabled = false;
  }
});
document.getElementById("close").addEventListener("click", async () => {
  try {
    await fetch("", { method: "DELETE" });
    location.href = "../../";
  } catch (error) { refuse(error); }
});
form.addEventListener("change", follow);
addEventListener("load", follow); // plotly.js comes last
follow();
addEventListener("pageshow", () => { form.querySelector("[type=submit]").disabled = false; });
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", follow);
